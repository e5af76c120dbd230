"""The command ``trajevo``."""
