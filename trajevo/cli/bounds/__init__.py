"""The command ``trajevo bound``."""
