"""Bounds from below: what no motion of a kind can be better than, by branch and bound over boxes of segment times."""
