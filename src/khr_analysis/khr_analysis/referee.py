"""The referee of a bout: knockdowns, the ring, and the time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import atan2, ceil, cos, hypot, radians, sin, sqrt
from typing import Any, NamedTuple

from khr_analysis.outcome import OBSERVED, MonitorParameters, Outcome, OutcomeMonitor
from khr_common import ParameterError, build, fixed
from khr_common.block import Block, NodeSpec, Numbers, Signals
from khr_common.interfaces import DECIDED, DECISION, TRUE_POSE

RED, BLUE = ROBOTS = ('red', 'blue')
DRAW = 'draw'
# m, semi-axes ahead and aside of the ellipse about the middle of the soles that holds a standing
# robot with its arms
AHEAD, ASIDE = 0.08, 0.135


def _start(x: float, heading_deg: float) -> Any:
    return fixed(
        (x, 0.0, heading_deg),
        'Place of the soles, x and y in m, and heading in deg (0 faces along x) at the start.',
        length=3,
    )


@dataclass(frozen=True)
class RefereeParameters:
    """The rules of a bout.

    Raises:
        ParameterError: if a robot starts outside of the ring, or inside the other one.
    """

    rounds: int = fixed(
        1,
        'Rounds, each with other seeds; a robot that wins more than half ends the bout.',
        '[1, 99]',
    )
    time_limit: float = fixed(180.0, 'Time of a round.', '[0.1, 3600] s')
    down_time: float = fixed(
        3.0, 'Time that a robot must stay down to lose the round.', '[0, 60] s'
    )
    fall_tilt_deg: float = fixed(
        MonitorParameters.fall_tilt_deg,
        'Angle between torso and vertical from which on a robot is down.',
        '[5, 90] deg',
    )
    fall_height: float = fixed(
        MonitorParameters.fall_height,
        'Height of the torso above the lower sole, over that at the start, below which a robot '
        'is down.',
        '[0, 1]',
    )
    ring_width: float = fixed(
        1.8, 'Distance between two opposite edges of the octagonal ring.', '[0.5, 10] m'
    )
    red_start: tuple[float, ...] = _start(-0.3, 0.0)
    blue_start: tuple[float, ...] = _start(0.3, 180.0)

    @property
    def down(self) -> dict[str, float]:
        """Return the parameters by which the monitors judge that a robot is down, by name."""
        return {
            'fall_tilt_deg': self.fall_tilt_deg,
            'fall_height': self.fall_height,
            'fall_time': self.down_time,
        }

    def __post_init__(self) -> None:
        for name in ('red_start', 'blue_start'):
            place = getattr(self, name)
            if beyond(place, self.ring_width):
                raise ParameterError.refused(name, list(place), 'a place in the ring')
        x, y = (self.red_start[n] - self.blue_start[n] for n in range(2))
        least = sum(_reach(atan2(y, x), start[2]) for start in (self.red_start, self.blue_start))
        if hypot(x, y) < least:
            raise ParameterError.refused(
                'blue_start',
                list(self.blue_start),
                f'{ceil(100.0 * least) / 100.0:.2f} m from red_start at least',
            )


def _reach(direction: float, heading_deg: float) -> float:
    """Return the reach of the ellipse of a robot in a direction, rad: m."""
    turned = direction - radians(heading_deg)
    return hypot(AHEAD * cos(turned), ASIDE * sin(turned))


class Decision(NamedTuple):
    """The end of a round."""

    winner: str  # red, blue or draw
    reason: str  # in a few words
    time: float  # s


def beyond(place: Sequence[float], width: float) -> bool:
    """Return whether a place (x, y, ...) in m is outside of an octagon of a width in m."""
    x, y = abs(place[0]), abs(place[1])
    return max(x, y, (x + y) / sqrt(2.0)) > width / 2.0


def judge(
    rules: RefereeParameters,
    time: float,
    outcomes: Mapping[str, Outcome],
    places: Mapping[str, Sequence[float]],
) -> Decision | None:
    """Return the decision of a round at a sample; None while the round goes on.

    A robot loses that has stayed down for the time of the rules, or that has left the ring with
    its torso. While both are down both are counted: a round that both lose, or that reaches
    its time limit, is a draw.

    Args:
        rules: of the bout.
        time: of the sample, s.
        outcomes: of both robots so far; each falls as soon as it is down.
        places: of both torsos on the ground, x and y in m.
    """
    out = [robot for robot in ROBOTS if beyond(places[robot], rules.ring_width)]
    if out:
        return _lost(out, 'out of the ring', time)
    down = {robot: each.fell_at for robot, each in outcomes.items() if each.fell_at is not None}
    counted = [robot for robot, since in down.items() if time - since >= rules.down_time]
    if counted and len(counted) == len(down):
        return _lost(counted, f'down for {rules.down_time:g} s', time)
    if time >= rules.time_limit - 1e-9:
        return Decision(DRAW, 'time', time)
    return None


def _lost(robots: Sequence[str], how: str, time: float) -> Decision:
    if len(robots) > 1:
        return Decision(DRAW, f'both {how}', time)
    return Decision(BLUE if robots[0] == RED else RED, f'{robots[0]} {how}', time)


class RefereeBlock(Block[RefereeParameters]):
    """Judge a round by the ground truth of both robots, at each sample until it is decided.

    Attributes:
        decision: of the round; None while it goes on.
    """

    subscribes = tuple(topic.under(robot) for robot in ROBOTS for topic in OBSERVED)
    publishes = (DECIDED,)

    def __init__(self, parameters: RefereeParameters) -> None:
        super().__init__(parameters)
        own = build(MonitorParameters, parameters.down)
        self._monitors = {robot: OutcomeMonitor(own) for robot in ROBOTS}
        self._seen = {
            robot: [(topic, topic.under(robot)) for topic in OBSERVED] for robot in ROBOTS
        }
        self.decision: Decision | None = None

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return whether the round is decided, and the number of its winner."""
        if self.decision is None:
            stamp_ns = round(time * 1e9)
            outcomes = {
                robot: monitor.update(
                    stamp_ns, {topic: signals[full] for topic, full in self._seen[robot]}
                )
                for robot, monitor in self._monitors.items()
            }
            places = {robot: signals[TRUE_POSE.under(robot)] for robot in ROBOTS}
            self.decision = judge(self.parameters, time, outcomes, places)
        if self.decision is None:
            return ((0.0, 0.0),)
        return ((1.0, float((DRAW, *ROBOTS).index(self.decision.winner))),)


REFEREE = NodeSpec(
    'referee',
    'khr_analysis',
    RefereeParameters,
    RefereeBlock,
    publishes=(DECIDED, DECISION),
    node='khr_analysis.nodes.referee:RefereeNode',
    joins=lambda _: False,  # only in a bout
)
