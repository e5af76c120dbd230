"""Limits, one file for each kind."""
