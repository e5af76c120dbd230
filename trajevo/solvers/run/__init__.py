"""Runs: generations, checkpoints, folders, resuming."""
