"""Who stays up over inclination, gain and friction."""
