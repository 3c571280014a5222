"""The offline twin: the same cores as the nodes', called in turn, without ROS."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from khr_analysis.outcome import Outcome, OutcomeMonitor
from khr_balance.ankle import AnkleController
from khr_balance.gait import Gait
from khr_balance.hip import HipController
from khr_balance.stage import Stage, StagePolicy
from khr_bringup.scenario import Scenario
from khr_sim.foot_force import FootForce
from khr_sim.gyro import Gyro
from khr_sim.plant import Plant, mix
from khr_sim.truth import Truth

ANKLES = ('l_ankle_pitch', 'r_ankle_pitch')
HIPS = ('l_hip_pitch', 'r_hip_pitch')
Watch = Callable[[Truth, 'Controllers', Outcome], object]  # called at each instant of a run


@dataclass(frozen=True)
class OfflineResult:
    """How a run ended: the monitor's outcome, the trajectory hash and the last instant in s."""

    outcome: Outcome
    trajectory_hash: str
    time: float
    end: str


def duration(scenario: Scenario) -> float:
    """Return how long the scenario's run lasts in s: its own duration, or the motion's."""
    own = scenario.table('simulator').duration
    return float(own or Gait(scenario.table('gait')).duration)


class Controllers:
    """The sensing and control side of one scenario: from a truth to the target it asks for.

    Attributes:
        pitch_rate: as the board last read it, rad/s.
        forces: on l_toe, l_heel, r_toe, r_heel as the sensors last told them, N.
        ankle_correction, hip_correction: the last ones, rad.
        stage: what the stage node last decided; None without one.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.gait = Gait(scenario.table('gait'))
        self.gyro = Gyro(scenario.table('gyro'))
        self.foot_force = FootForce(scenario.table('foot_force'))
        self.ankle = AnkleController(scenario.table('ankle_controller'))
        self.hip = HipController(scenario.table('hip_controller'))
        stages = scenario.table('stage')
        self._stages = StagePolicy(stages) if stages.mode != 'none' else None
        self.stage: Stage | None = None
        self._ankle_source = scenario.table('ankle_controller').source
        self.pitch_rate = self.ankle_correction = self.hip_correction = 0.0
        self.forces: Sequence[float] = (0.0, 0.0, 0.0, 0.0)

    def reference(self, time: float) -> list[float]:
        """Return the gait's 17 joint angles in rad at ``time`` s."""
        return list(self.gait.reference(time))

    def answer(self, truth: Truth) -> list[float]:
        """Return the mixed target, 17 joint angles in rad, that answers ``truth``."""
        time = truth.stamp_ns / 1e9
        self.pitch_rate = self.gyro.update(truth.angular_rate.tolist())[1]
        self.forces = self.foot_force.update(truth.contact_force.tolist())
        ankle_share = hip_share = None
        if self._stages is not None:
            self.stage = self._stages.update(self.forces, truth.joint_position.tolist())
            ankle_share, hip_share = self.stage.ankle, self.stage.hip
        if self._ankle_source == 'gyro':
            ankle = self.ankle.update(time, pitch_rate=self.pitch_rate, share=ankle_share)
        else:
            ankle = self.ankle.update(time, foot_forces=self.forces, share=ankle_share)
        hip = self.hip.update(time, self.pitch_rate, hip_share)
        self.ankle_correction, self.hip_correction = ankle, hip
        return mix(self.reference(time), [dict.fromkeys(ANKLES, ankle), dict.fromkeys(HIPS, hip)])


def run_offline(scenario: Scenario, watch: Watch | None = None) -> OfflineResult:
    """Run a scenario as fast as the physics goes.

    Args:
        scenario: what to run.
        watch: called with the truth, the controllers and the outcome so far of each instant.
    """
    parameters = replace(scenario.table('simulator'), duration=duration(scenario))
    plant = Plant(parameters)
    try:
        return _run(scenario, plant, Controllers(scenario), watch)
    finally:
        plant.world.close()


def _run(
    scenario: Scenario, plant: Plant, controllers: Controllers, watch: Watch | None
) -> OfflineResult:
    monitor = OutcomeMonitor(scenario.table('monitor'))
    delayed = plant.parameters.control_delay > 0
    due = controllers.reference(0.0)  # what the board holds before the first answer
    truth = plant.start(due)
    while True:
        answer = controllers.answer(truth)
        outcome = monitor.update(truth)
        if watch is not None:
            watch(truth, controllers, outcome)
        if plant.end:
            return OfflineResult(outcome, plant.trajectory_hash, truth.stamp_ns / 1e9, plant.end)
        truth = plant.advance(due if delayed else answer)
        due = answer
