"""Map where the robot stays up over inclination, gain and friction."""
