"""Solvers that follow exact gradients."""
