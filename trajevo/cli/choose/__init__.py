"""The command ``trajevo choose-robot``."""
