"""What rules a motion out, or nearly does, told before a search: one file for each kind of reason."""
