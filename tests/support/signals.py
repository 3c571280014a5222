"""Signals of one instant, as a controller receives them, and what it answers."""

from khr_common.interfaces import FOOT_FORCES, GYRO, STAGE


def signals(rate=None, forces=None, stage=None, roll_rate=0.0):
    """Return the signals of rates (rad/s), four normal forces (N), shares by controller."""
    found = {} if rate is None else {GYRO: (roll_rate, rate, 0.0)}
    if forces is not None:
        found |= {topic: (0.0, 0.0, each) for topic, each in zip(FOOT_FORCES, forces, strict=True)}
    if stage is not None:
        found[STAGE] = tuple(stage.get(name, 0.0) for name in STAGE.names)
    return found


def corrected(controller, time=0.0, **given):
    """Return the one angle, rad, that a controller adds to each of its joints."""
    (angles,) = controller.update(time, signals(**given))
    assert len(angles) == len(controller.publishes[0].names)
    assert len(set(angles)) == 1 or angles[0] != angles[0]
    return angles[0]
