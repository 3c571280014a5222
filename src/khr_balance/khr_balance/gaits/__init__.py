"""Motions: standing, the leg lift and the walk."""
