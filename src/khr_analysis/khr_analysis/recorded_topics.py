"""What a recorder keeps by default."""

from __future__ import annotations

from khr_common import interfaces as topics

# What every run has, whatever nodes take part; the topics of further nodes come with them.
OF_EVERY_RUN = (
    topics.CLOCK,
    topics.JOINT_STATES,
    topics.TRUE_POSE,
    topics.TRUE_RATE,
    topics.TRUE_SOLES,
    topics.TRUE_INCLINATION,
    *topics.TRUE_FORCES,
    topics.GYRO,
    *topics.FOOT_FORCES,
    topics.JOINT_REFERENCE,
    topics.ANKLE_CORRECTION,
    topics.HIP_CORRECTION,
    topics.ROBOT_DESCRIPTION,
    topics.TF,
    topics.TF_STATIC,
    topics.STATE,
    topics.READY,
    topics.OUTCOME,
    topics.SPECTRUM,
    topics.PEAKS,
    topics.PUSH,
    topics.PUSHED,
    topics.DIAGNOSTICS,
    topics.PARAMETER_EVENTS,
    topics.LOG,
)
