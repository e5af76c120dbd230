"""The sheet of a payload: one page to check and sign, and the same as JSON."""
