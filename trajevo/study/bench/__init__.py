"""The benchmark suite: published problems, the best that is known of each, and every solver on equal terms."""
