"""What a payload's ten inertial parameters add to the efforts of the joints, and how well a motion shows them."""
