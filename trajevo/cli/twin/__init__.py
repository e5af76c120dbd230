"""Commands that play motions in closed loop."""
