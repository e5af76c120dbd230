"""Populations: algorithms, their operators and their first generation."""
