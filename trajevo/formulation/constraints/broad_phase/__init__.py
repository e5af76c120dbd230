"""Lower bounds of distances by balls, and the pairs of solids that they leave for the exact distances."""
