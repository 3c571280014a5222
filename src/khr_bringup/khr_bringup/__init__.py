"""Scenarios, their runs as graphs and offline, and the files of a run."""
