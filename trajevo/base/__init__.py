"""Words that every room uses: arrays, units, files, TOML, threads, signals, compiled loops, polynomials, intervals."""
