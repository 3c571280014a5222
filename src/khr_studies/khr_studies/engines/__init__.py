"""The same robot on two physics engines."""
