"""Bounds of efforts, computed in loops."""
