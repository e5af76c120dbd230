"""Keys of tables in tasks, which other files have too."""
