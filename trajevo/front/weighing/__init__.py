"""Weights of objectives: the ways to find them, and how far a choice depends on them."""
