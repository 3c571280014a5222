"""Compare the physics engines on the same robot."""
