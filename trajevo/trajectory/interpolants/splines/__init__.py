"""Splines through via points, and with free points or control points between them."""
