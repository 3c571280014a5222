"""Rotations, filters, seeds."""
