"""Proofs that a motion keeps its limits, and checks of solutions by independent computations."""
