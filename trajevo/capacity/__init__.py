"""What a robot can carry along a motion."""
