"""Figures and tables of papers, made again beside the numbers that are printed there."""
