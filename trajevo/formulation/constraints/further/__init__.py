"""Further kinds of limits: the user's own, of dexterity and effort rate, and of segments along lines and arcs."""
