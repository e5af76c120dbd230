"""What comes out of a search: fronts, solutions, and how one is chosen."""
