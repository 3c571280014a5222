"""Every result of the thesis beside the simulated robot's."""
