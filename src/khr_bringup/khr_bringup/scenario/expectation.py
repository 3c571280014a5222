"""The expected result of a run: a verdict, and real time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

from khr_analysis.outcome import SensedVerdict, Verdict
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_common.pacing import HELD, NOT_HELD, RealTime
from khr_sim.run_parameters import RunParameters

REALTIME = 'realtime'
VERDICTS = tuple(dict.fromkeys((*get_args(Verdict), *get_args(SensedVerdict))))
MEANING = (
    'Exit with 1 unless the outcome is this: walked, stood, fell or slipped (without ground truth: '
    'upright or fell), realtime (the run kept up with the wall clock), or both: walked,realtime.'
)


@dataclass(frozen=True)
class Expectation:
    """The expected result of a run; by default anything is accepted."""

    verdict: str = ''  # of the monitor; empty if any is
    realtime: bool = False  # whether the run must keep up with real time

    @staticmethod
    def parse(text: str, option: str, scenario: Scenario, offline: bool = False) -> Expectation:
        """Parse the text of an option.

        Args:
            text: a verdict, ``realtime``, or both with a comma between; empty expects nothing.
            option: its name.
            scenario: to run.
            offline: whether it is to run without a graph.

        Raises:
            KhrError: if the text is not accepted, or the run does not follow the wall clock.
        """
        words = [word.strip() for word in text.split(',')] if text else []
        verdicts = [word for word in words if word != REALTIME]
        if len(verdicts) > 1 or set(verdicts) - set(VERDICTS):
            raise KhrError(
                f'{option}: {text!r} is not accepted; accepted: {" | ".join(VERDICTS)}, '
                f'{REALTIME}, or one of these and {REALTIME} with a comma between'
            )
        lockstep = scenario.table(RunParameters).sync == 'lockstep'
        if REALTIME in words and (lockstep or offline):
            raise KhrError(
                f'{option}: {REALTIME} is not accepted of a run that does not follow the wall '
                'clock; accepted: with simulator.sync=realtime'
            )
        return Expectation(verdicts[0] if verdicts else '', REALTIME in words)

    def unmet(self, verdict: str, realtime: RealTime | None) -> str:
        """Describe in one line the expectation that was not met; empty if all were met.

        Args:
            verdict: of the run.
            realtime: how it kept to the wall clock; None if the simulator did not report it.
        """
        if self.verdict and verdict != self.verdict:
            return f'expected {self.verdict}, the outcome is {verdict or "unknown"}'
        if self.realtime and not (realtime and realtime.held):
            return f'expected real time to be held: {realtime_text(realtime)}'
        return ''


def realtime_text(realtime: RealTime | None) -> str:
    """Return in one line how a run kept to the wall clock."""
    if realtime is None:
        return 'the simulator did not report it'
    return (
        f'{HELD if realtime.held else NOT_HELD}: speed {realtime.factor:.3f}, '
        f'{realtime.missed} of {realtime.periods} periods late, '
        f'{realtime.stale} corrections too old'
    )
