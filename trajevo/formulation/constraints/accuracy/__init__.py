"""Limits of accuracy, and of a robot's contacts with its payload and the floor."""
