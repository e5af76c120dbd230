"""Pictures of cells that vary: where the robot should stand."""
