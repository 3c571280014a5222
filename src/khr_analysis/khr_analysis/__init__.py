"""Spectrum, peaks, outcome and recording of runs."""
