"""Results of a search: fronts, their solutions, and rules that choose one of them."""
