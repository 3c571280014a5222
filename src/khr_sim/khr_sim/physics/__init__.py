"""The world of the robot: engines, contact, pushes, the truth of an instant."""
