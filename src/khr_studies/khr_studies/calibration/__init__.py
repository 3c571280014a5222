"""Identification of the unpublished constants of the robot from published results."""
