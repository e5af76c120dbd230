"""The page of a run: one HTML file in which the front, its motions and the robot answer to a click."""
