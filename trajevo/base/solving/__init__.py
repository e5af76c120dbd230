"""Equations and least squares, many at once."""
