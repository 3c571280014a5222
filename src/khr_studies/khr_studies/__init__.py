"""Experiments on the simulated robot: sweeps, critical inclinations, pushes, calibration."""
