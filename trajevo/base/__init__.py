"""Tools that all other folders use.

Arrays, units, files, TOML, entry points, threads, signals, compiled loops, polynomials, sampling and intervals.
"""
