"""Figures of models, runs and experiments, as PNG with the CSV of their points."""
