"""Invented robots: candidates of a calibration whose limits follow from their constants."""

from khr_studies.calibration.objective import Candidate, cost_of
from khr_studies.calibration.plan import CalibrationPlan, FreeConstant
from khr_studies.calibration.rows import WantedLimit, WantedWalk

PLAN = CalibrationPlan(
    {
        'sway': FreeConstant(('gait.sway',), (0.01, 0.04), 'invented'),
        'board': FreeConstant(
            ('simulator.friction_smooth',), (0.1, 0.4), 'invented', 'derived', (0.2, 0.3), True
        ),
        'lift': FreeConstant(('gait.lift',), (0.01, 0.03), 'invented'),
    },
    (WantedLimit('walk', 5.9), WantedLimit('walk', 9.2, ka=12.0)),
    walks=(WantedWalk(0.0, cycles=20),),
)
TITLES = [row.title for row in PLAN.limits]


def robot(sway=0.025, board=0.2, lift=0.02, complete=True, lasted=1.0):
    """Return a robot; sway decides its limits, lift nothing."""
    base = 5.9 + 200.0 * (sway - 0.025)
    return measured(
        {'sway': sway, 'board': board, 'lift': lift},
        {
            TITLES[0]: [base],
            TITLES[1]: [base + 3.3 + 5.0 * (board - 0.2)],
            PLAN.walks[0].title: [lasted],
        },
        complete,
    )


def measured(constants, values, complete=True):
    """Return a robot with these values by row."""
    found = Candidate(constants, {'mujoco': values})
    return Candidate(constants, found.values, cost_of(PLAN, found, 'mujoco'), complete, runs=7)


def measure(task):
    """Measure a candidate: a stand-in of ``measure_robot``."""
    return robot(**task.constants)
