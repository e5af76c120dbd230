"""The commands ``trajevo bench``."""
