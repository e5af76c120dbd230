"""Pictures of a cell: in which order and how its points are visited."""
