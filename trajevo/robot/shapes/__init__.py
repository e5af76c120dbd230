"""Shapes of links: their meshes, checked, placed on joints, simplified and kept."""
