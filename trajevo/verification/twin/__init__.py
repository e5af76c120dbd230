"""The twin: motions played in closed loop on a simulated robot, by MuJoCo."""
