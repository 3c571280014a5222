"""Stored results of runs and jobs, so that they are not computed again."""
