"""The servo: its loop, its identification, its stiffness."""
