"""Pictures of drives: their power and energy."""
