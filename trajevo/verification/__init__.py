"""What is proven of a motion, or computed again by other means."""
