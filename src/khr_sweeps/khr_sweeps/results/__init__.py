"""What is kept of runs and jobs, so that it is not computed again."""
