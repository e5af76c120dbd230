"""Effort of a whole population: at samples, and enclosed between them."""
