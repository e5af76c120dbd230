"""Pictures of a cell: where its robot stands, and in which order and how its points are visited."""
