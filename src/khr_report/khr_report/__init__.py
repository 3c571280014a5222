"""Figures, pages and films of runs and experiments."""
