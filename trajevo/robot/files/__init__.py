"""The files of a robot: read by their formats, put in a cell with a tool, and chosen from."""
