"""What a robot is loaded from besides the file of a URDF: a Denavit-Hartenberg table, or joints and limits alone."""
