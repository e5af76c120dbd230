"""A payload's mass, centre of mass and inertia from a log of torques or currents, with what is known of each."""
