"""What the user brings along: functions and classes by their places in Python."""
