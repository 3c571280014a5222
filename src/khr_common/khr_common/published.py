"""Published numbers that several packages share: of Dutta (2021), and of the maker of the servo."""

GAIT_PERIOD = 2.31  # s, two steps: 154 frames of 15 ms
GAIT_FREQUENCY = 4.0 / GAIT_PERIOD  # Hz, f_0: four peaks per gait cycle

STALL_TORQUE = 1.373  # N m, KRS-2552RHV at 11.1 V
NO_LOAD_SPEED = 7.48  # rad/s, the same
