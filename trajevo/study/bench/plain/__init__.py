"""What plain statements are made of: motions by SciPy, efforts by Pinocchio, and the bounds of motions along paths."""
