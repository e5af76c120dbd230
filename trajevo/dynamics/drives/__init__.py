"""What motors bear on a motion: torque through gears, averages and temperatures over a cycle that repeats."""
