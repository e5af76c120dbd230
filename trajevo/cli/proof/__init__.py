"""The command ``trajevo check-proof``."""
