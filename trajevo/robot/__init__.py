"""The robot: model, limits, friction, transmission, kinematics and payload, and the files that it is loaded from."""
