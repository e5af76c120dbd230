"""Solvers that use gradients."""
