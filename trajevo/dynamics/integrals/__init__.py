"""Integrals and greatest values over whole motions, to a ten-thousandth: efforts, travel, path of the tool."""
