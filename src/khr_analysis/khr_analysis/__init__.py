"""Spectrum, outcome, recording and pendulum models for balance experiments."""
