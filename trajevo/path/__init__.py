"""What must be visited: via points, tool poses, boxes in which a point may move, geometric curves."""
