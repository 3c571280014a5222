"""The figures of the thesis."""
