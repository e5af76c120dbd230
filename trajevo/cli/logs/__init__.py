"""The commands that read logs of a moving robot."""
