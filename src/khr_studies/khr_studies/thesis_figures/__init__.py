"""The figures of the thesis, from models and from simulated runs."""
