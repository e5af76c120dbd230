"""Machine code of compiled loops as a file, which is called without numba: its import takes half a second."""
