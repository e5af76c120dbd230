"""Times of many points by a smooth pace: a good pace to begin with, and few variables that change it."""
