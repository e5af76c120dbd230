"""What no time law along a fixed path can do better than: lower bounds by convex relaxation, proven by their duals."""
