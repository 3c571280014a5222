"""Force sensors and gyro, the gyro down to its circuit."""
