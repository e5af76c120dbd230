"""Pictures of what logs tell."""
