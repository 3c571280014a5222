"""Bouts: two robots in one ring."""
