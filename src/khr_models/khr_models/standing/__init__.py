"""Standing: ankle, tipping, friction, the force loop, pushes."""
