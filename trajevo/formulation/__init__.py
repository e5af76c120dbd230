"""Problems: a robot, an interpolant, objectives and constraints; tasks that state them in a file."""
