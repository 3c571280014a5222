"""The source of the simulation's constants, and the rows on which some of them are fitted.

The defaults of the parameter tables are the calibrated constants. A fit moves one constant until
the robot is on the verge of a fall on one or two rows of the thesis; nothing is fitted per
scenario.
"""

from __future__ import annotations

from dataclasses import dataclass

from khr_experiments.critical import Condition


@dataclass(frozen=True)
class Held:
    """A row of the thesis on which its robot did not fall."""

    condition: Condition
    inclination_deg: float
    text: str


@dataclass(frozen=True)
class Fit:
    """One fitted constant.

    Attributes:
        node, key: the parameter.
        low, high: ends of the search; the robot survives at one and falls at the other.
        decimals: to which the result is rounded.
        rows: of the thesis, which the robot must just survive.
    """

    node: str
    key: str
    low: float
    high: float
    decimals: int
    rows: tuple[Held, ...]


@dataclass(frozen=True)
class Constant:
    """A constant that matters to the results, and its source.

    Attributes:
        node, key: the parameter, whose default is the value.
        kind: measured | published | derived | assumed.
        source: in words.
    """

    node: str
    key: str
    kind: str
    source: str


# In this order: a later fit uses the earlier results.
FITS = (
    Fit(
        'gait',
        'com_stance',
        -0.009,
        -0.001,
        4,
        (Held(Condition('leg_lift'), 6.4, 'standing, stage 1: no control, 6.4 deg'),),
    ),
    Fit(
        'ankle_controller',
        'force_scale',
        0.001,
        0.0035,
        5,
        (
            Held(
                Condition('leg_lift', 12.0),
                7.6,
                'standing, stage 2: K_A = 12 on the force difference, 7.6 deg',
            ),
        ),
    ),
    Fit(
        'gait',
        'com_lifted',
        0.008,
        0.02,
        4,
        (
            Held(Condition('walk'), 5.55, 'walking without control, 5.55 deg'),
            Held(Condition('walk', 12.0), 7.68, 'walking with K_A = 12, 7.68 deg'),
        ),
    ),
)

CONSTANTS = (
    Constant(
        'simulator',
        'friction_smooth',
        'derived',
        'tan(10.2 deg): a foot slides from 10.2 deg on, where the thesis finds the smooth '
        'surface to slip with any control',
    ),
    Constant(
        'simulator',
        'pad_distance',
        'derived',
        'rigid tipping at 6.3 deg with the centre of mass over the ankle; the thesis has '
        'b/l = 0.1',
    ),
    Constant('simulator', 'friction_rubber', 'assumed', 'rubber on a board'),
    Constant('simulator', 'friction_pads', 'assumed', 'pads that do not slide'),
    Constant('simulator', 'control_period', 'published', "the maker's sample project, RCB-4HV"),
    Constant('simulator', 'stretch_ankle_pitch', 'published', "the maker's walk"),
    Constant('simulator', 'stretch_knee', 'published', "the maker's walk"),
    Constant('simulator', 'stretch_hip', 'published', "the maker's walk"),
    Constant(
        'simulator',
        'stiffness_per_stretch',
        'assumed',
        'within what others use for servos of this size, 7 to 18.5 N m/rad',
    ),
    Constant('simulator', 'rotor_inertia', 'assumed', 'within what others use, 1e-3 to 1e-2'),
    Constant('simulator', 'servo_friction', 'assumed', 'within what others use, 0.02 to 0.2'),
    Constant('simulator', 'gear_stiffness', 'assumed', 'horn and bracket'),
    Constant('gyro', 'sensitivity', 'published', 'Dutta (2021), (5.2)'),
    Constant(
        'gyro',
        'bandwidth',
        'assumed',
        'no data sheet; chosen in early trials, where of 1, 2 and 4 Hz it let the robot walk '
        'steepest with both controls, so it is not blind to that row',
    ),
    Constant('gyro', 'noise', 'assumed', 'a tenth of a step of the converter'),
    Constant(
        'foot_force',
        'time_constant',
        'assumed',
        'slow sensors: with a fast one the force loop is unstable on two feet, for a toe '
        'that is pushed down reads more force',
    ),
    Constant('gait', 'cycle_period', 'published', "the thesis, and the maker's walk"),
    Constant('gait', 'stride', 'published', "the maker's walk"),
    Constant('gait', 'com_touchdown', 'published', "within the maker's walk, 24 to 31 mm"),
    Constant('gait', 'torso_pitch', 'published', "within the maker's walk, -2 to 7 deg"),
)
