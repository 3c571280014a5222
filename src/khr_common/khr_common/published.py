"""Published numbers that several packages share: of Dutta (2021), and of the makers."""

GAIT_PERIOD = 2.31  # s, two steps: 154 frames of 15 ms
GAIT_3 = 3  # number of the cycle of a walk of which the thesis shows rate and spectrum
GAIT_FREQUENCY = 4.0 / GAIT_PERIOD  # Hz, f_0: four peaks per gait cycle

STALL_TORQUE = 1.373  # N m, KRS-2552RHV at 11.1 V
NO_LOAD_SPEED = 7.48  # rad/s, the same
SERVO_STEP_DEG = 0.03375  # deg per count of its target

AD_STEP = 5.0 / 1024.0  # V per count of the board's converter, 10 bit over 0 to 5 V
CONTROL_PERIODS = (0.010, 0.015, 0.020, 0.025)  # s, output cycles of the RCB-4HV by their code

GYRO_SENSITIVITY = 0.67e-3  # V per deg/s, (5.2)
