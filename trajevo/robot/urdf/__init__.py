"""URDF files: how they are read, what is refused in them, and their links, bodies and joints."""
