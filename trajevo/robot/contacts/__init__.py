"""Where a robot touches the world: the grip on its payload, and what it stands on."""
