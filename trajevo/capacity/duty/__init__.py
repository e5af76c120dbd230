"""What an arm carries over a shift: one motion at many speeds, with many loads, and many shares of time in motion."""
