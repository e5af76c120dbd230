"""Pictures of motions in closed loop."""
