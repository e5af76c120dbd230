"""Obstacles, what is attached to a robot's links, and the files that hold scenes."""
