"""A simulator of the KONDO KHR-3HV, its foot-force sensors and its gyro."""
