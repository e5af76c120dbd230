"""From a problem to its front."""
