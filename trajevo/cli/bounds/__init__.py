"""Commands that bound fronts from below."""
