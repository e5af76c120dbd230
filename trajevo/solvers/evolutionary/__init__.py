"""Evolutionary algorithms, their operators and their first populations."""
