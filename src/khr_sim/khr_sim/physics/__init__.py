"""The simulated world: engines, contact, pushes, ground truth."""
