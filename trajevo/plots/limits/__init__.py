"""Pictures of which limit binds."""
