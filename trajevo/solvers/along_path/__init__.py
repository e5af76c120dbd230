"""The best motions along a fixed path: sequences of sparse convex programs in the control points of u(t)."""
