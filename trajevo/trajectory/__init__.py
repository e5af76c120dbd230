"""Motions of a whole population as arrays, with exact extremes and integrals."""
