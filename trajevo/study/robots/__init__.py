"""Which robot: one task for several robots, as a study, with one front over all of them."""
