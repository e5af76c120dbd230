"""What is left open of the points: which posture reaches each of them, and in which order they are visited."""
