"""Which peaks of the spectrum come from the gait, and which from the control."""
