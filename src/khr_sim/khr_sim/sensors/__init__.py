"""Models of the force sensors and of the gyro."""
