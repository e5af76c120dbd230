"""What moves: the model, its limits, friction, transmission and payload, and one file for each source of a robot."""
