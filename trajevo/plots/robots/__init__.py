"""Pictures of several robots at one task."""
