"""Files for controllers and other programs."""
