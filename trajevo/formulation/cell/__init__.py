"""The cell as decision variables: where the robot stands, how it reaches points and in which order it visits them."""
