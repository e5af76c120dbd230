"""MJCF, the format of MuJoCo, read as the URDF that describes the same robot."""
