"""Commands about a cell that varies."""
