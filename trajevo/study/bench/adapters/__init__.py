"""Rivals: one file each, found by their names; to add one, add a file with a class of :class:`BenchRival`."""
