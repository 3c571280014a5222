"""The result of a calibration as data, and the source of the constants that no search moves.

The defaults of the parameter tables are the constants of the best robot found; nothing is fitted
per scenario.
"""

from __future__ import annotations

from dataclasses import dataclass

import yaml

from khr_studies.calibration.ensemble import Ensemble, Resisting
from khr_studies.calibration.objective import Candidate
from khr_studies.calibration.plan import CalibrationPlan


@dataclass(frozen=True)
class ConstantLean:
    """The constant part of the ankle's correction in a walk.

    Attributes:
        deg: mean of the correction.
        share: of its mean square that the mean makes.
    """

    deg: float
    share: float


@dataclass(frozen=True)
class Calibration:
    """What ``khr calibrate`` found.

    Attributes:
        plan: constants and rows.
        engine, seed, seeds: of the search.
        runs: how many it took.
        found: the robots that fit, the best first.
        lean: of the best robot with K_A 12 at 8.88 deg; None if it was not measured.
        searched: candidates of the search.
        kinds: the best robot with each kind of offset.
        resisting: the rows that the best robot misses.
    """

    plan: CalibrationPlan
    engine: str
    seed: int
    seeds: int
    runs: int
    found: Ensemble
    lean: ConstantLean | None = None
    searched: int = 0
    kinds: tuple[Candidate, ...] = ()
    resisting: tuple[Resisting, ...] = ()

    @property
    def best(self) -> Candidate:
        """Return the robot that the defaults hold."""
        return self.found.best


@dataclass(frozen=True)
class Constant:
    """A constant that matters to the results and that no search moves, and its source.

    Attributes:
        node, key: the parameter, whose default is the value.
        kind: measured | published | derived | assumed.
        source: in words.
    """

    node: str
    key: str
    kind: str
    source: str


CONSTANTS = (
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
    Constant('simulator', 'pid_kp', 'published', 'Dutta (2021), (3.12)'),
    Constant('simulator', 'pid_ki', 'published', 'Dutta (2021), (3.12)'),
    Constant('simulator', 'pid_kd', 'published', 'Dutta (2021), (3.12)'),
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


def parameter_file(plan: CalibrationPlan, robot: Candidate) -> str:
    """Return a ROS 2 parameter file with the constants of a robot."""
    nodes: dict[str, dict[str, dict[str, object]]] = {}
    for (node, key), value in plan.changes(robot.constants):
        nodes.setdefault(node, {'ros__parameters': {}})['ros__parameters'][key] = value
    return (
        '# The fitted constants, written by khr calibrate; the defaults of the parameter '
        'tables hold them.\n' + yaml.safe_dump(nodes, sort_keys=False)
    )
