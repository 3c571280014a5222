"""Recorded runs: read, repaired, repeated."""
