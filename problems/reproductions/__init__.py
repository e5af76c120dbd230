"""What the four papers show, made again: one file for each paper."""
