"""The command that writes the sheet of a payload."""
