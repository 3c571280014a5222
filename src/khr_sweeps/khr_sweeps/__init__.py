"""Runs of scenarios over grids of parameters or at random, on one or many machines."""
