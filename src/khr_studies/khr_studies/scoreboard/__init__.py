"""Compare every result of the thesis with the simulated robot."""
