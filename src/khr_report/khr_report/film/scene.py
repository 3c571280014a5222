"""The pictures of a film: the poses of a run in a scene without physics.

A bag holds the poses of any run, also of one that was changed or ran in real time. A run without a
bag is run again offline, bit for bit, and its trajectory hash is compared.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import nan, pi
from pathlib import Path

import numpy as np
from PIL import Image, ImageChops, ImageDraw

from khr_analysis.outcome import OBSERVED, Outcome
from khr_bringup.changes import Change
from khr_bringup.node_registry import controllers
from khr_bringup.offline import ControlLoop, duration, run_offline
from khr_bringup.recorded.bag_signals import judge, tracks_of
from khr_bringup.recorded.recorded_run import ACCEPTED, RecordedRun
from khr_bringup.result import FILE, read_outcome
from khr_bringup.scenario.scenario import Scenario, load_scenario
from khr_common import RunError
from khr_common.errors import KhrError, quoted
from khr_common.interfaces import GYRO, JOINT_STATES, STAGE, TRUE_INCLINATION
from khr_common.rotation import Array, matrix, pitched
from khr_description.robot import Robot, vector
from khr_sim.physics import engines
from khr_sim.physics.camera import SUN, Camera
from khr_sim.physics.truth import GroundTruth
from khr_sim.run_parameters import RunParameters

# The corners of a box, and the faces by the numbers of their corners, in order around each.
CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
SHADE = 0.8  # of the light that is left
POSES = (*OBSERVED, JOINT_STATES, TRUE_INCLINATION, GYRO, STAGE, *controllers().values())
SCENARIO_FILES = ('.yaml', '.yml')
HALF_HEIGHT = 0.145  # m, from the feet to where the camera looks
AHEAD = 0.02  # m, of the feet


class Shadow:
    """Shadow of the robot on its slope: each box of its description, thrown along the light.

    A renderer's own shadows take four times as long as the picture.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._boxes: list[tuple[str, Array]] = []
        for link in robot.xml.iter('link'):
            for visual in link.findall('visual'):
                box, origin = visual.find('geometry/box'), visual.find('origin')
                if box is not None:
                    corners = vector(origin, 'xyz') + CORNERS * vector(box, 'size')
                    self._boxes.append((link.attrib['name'], corners))

    def on_slope(self, truth: GroundTruth) -> Array:
        """Return the corners of all boxes thrown onto the slope, m in odom, (boxes, 8, 3)."""
        poses = self._robot.poses(truth.joint_position)
        turn, place = matrix(truth.orientation), np.asarray(truth.position)
        corners = np.array(
            [corners @ poses[link][:3, :3].T + poses[link][:3, 3] for link, corners in self._boxes]
        )
        corners = corners @ turn.T + place
        normal, sun = matrix(pitched(truth.inclination))[:, 2], np.array(SUN)
        thrown: Array = corners - (corners @ normal / (sun @ normal))[..., None] * sun
        return thrown

    def darken(
        self, picture: Image.Image, slope: Image.Image, truth: GroundTruth, camera: Camera
    ) -> None:
        """Darken the part of the slope in the shadow.

        Args:
            picture: to draw into.
            slope: white where the picture shows the slope.
            truth: where the robot is.
            camera: of the picture.
        """
        shadow = Image.new('L', picture.size)
        pen = ImageDraw.Draw(shadow)
        for box in camera.pixels(self.on_slope(truth)):
            for face in FACES:
                pen.polygon([tuple(box[corner]) for corner in face], 255)
        dark = picture.point(lambda value: round(value * SHADE))
        picture.paste(dark, (0, 0), ImageChops.logical_and(shadow.convert('1'), slope))


@dataclass(frozen=True)
class Look:
    """How a film looks."""

    # width, height: px
    width: int = 960
    height: int = 720
    rate: float = 25.0  # frames per simulated second
    # yaw, pitch: of the camera, rad; across the slope, so that its angle shows undistorted
    yaw: float = pi / 2.0
    pitch: float = -0.1
    distance: float = 1.15  # from the robot, m

    def camera(self, truth: GroundTruth) -> Camera:
        """Return the camera at a sample; it follows the feet, because the torso swings."""
        x, _, z = truth.sole_position.mean(axis=0).tolist()
        target = (x + AHEAD, 0.0, z + HALF_HEIGHT)
        return Camera(self.width, self.height, target, self.yaw, self.pitch, self.distance)


@dataclass(frozen=True, eq=False)
class Frame:
    """One sample of a run."""

    truth: GroundTruth
    pitch_rate: float  # that the gyro reads, rad/s
    outcome: Outcome  # so far
    corrections: Sequence[float] = ()  # of each controller of the scenario, rad
    stage: Sequence[float] = ()  # numbers of the topic stage

    @property
    def time(self) -> float:
        """Return its simulated time, s."""
        return self.truth.stamp_ns / 1e9


def scenario_of(run: str) -> Scenario:
    """Return the scenario of a run folder, or the one of that name or file."""
    folder = Path(run)
    if folder.is_dir():
        if not (folder / 'scenario.yaml').is_file():
            raise KhrError(f'{run}: no scenario.yaml in it; accepted: the folder of a run')
        return load_scenario(str(folder / 'scenario.yaml'))
    return load_scenario(run, 'run or scenario')


def frames(
    scenario: Scenario, run: str = '', show: Callable[[float], None] = lambda _: None
) -> list[Frame]:
    """Run a scenario offline and keep every sample.

    Args:
        scenario: to run.
        run: its run folder, if it has one, to compare the trajectory hash with.
        show: called with the time of each sample, s.

    Raises:
        RunError: if the trajectory differs from that of the folder.
    """
    kept: list[Frame] = []

    def keep(truth: GroundTruth, loop: ControlLoop, outcome: Outcome) -> None:
        stage = loop.signals.get(STAGE, ())
        kept.append(Frame(truth, loop.pitch_rate, outcome, loop.corrections, stage))
        show(kept[-1].time)

    result = run_offline(scenario, keep)
    if run and (Path(run) / FILE).is_file():
        recorded = read_outcome(Path(run))
        before = recorded.trajectory_hash
        if recorded.end != 'stopped' and before != result.trajectory_hash:
            raise RunError(
                f'{run}: the run did not repeat: trajectory hash {result.trajectory_hash}, '
                f'recorded {quoted(before)}; was it made with other versions?'
            )
    return kept


@dataclass(frozen=True, eq=False)
class Source:
    """A run to film."""

    scenario: Scenario  # as it began
    length: float  # s
    # returns all samples; called with a callback that takes the time of each, s
    frames: Callable[[Callable[[float], None]], list[Frame]]
    changes: tuple[Change, ...] = ()  # of parameters while it ran


def source_of(run: str, namespace: str = '') -> Source:
    """Return a recorded run as it was recorded; a scenario, or a run without a bag, is run."""
    path = Path(run)
    if path.exists() and path.suffix not in SCENARIO_FILES:
        recorded = RecordedRun(path, POSES, salvage=True, namespace=namespace)
        if recorded.has_bag:
            kept = recorded_frames(recorded)
            length = kept[-1].time
            return Source(recorded.parameters, length, lambda _: kept, recorded.changes)
    if namespace:
        raise KhrError(f'--namespace: {run} has no bag; accepted: the bag of several robots')
    scenario = scenario_of(run)
    return Source(scenario, duration(scenario), lambda show: frames(scenario, run, show))


def recorded_frames(run: RecordedRun) -> list[Frame]:
    """Return the samples of a bag."""
    controls = run.parameters.corrections.values()
    tracks = tracks_of(run.messages, [topic for topic in run.messages if topic in POSES])
    stamps, outcomes = judge(tracks, run.parameters, run.changes)
    if not outcomes:
        raise KhrError(f'{run.path}: no poses of the robot in it; {ACCEPTED}')
    found = []
    for number, (stamp_ns, outcome) in enumerate(zip(stamps.tolist(), outcomes, strict=True)):
        signals = {topic: each.at(stamp_ns) for topic, each in tracks.items() if len(each.stamps)}
        rate = signals[GYRO][1] if GYRO in signals else nan
        corrections = [signals[topic][0] if topic in signals else nan for topic in controls]
        truth = GroundTruth.of_signals(number, stamp_ns, signals)
        found.append(Frame(truth, rate, outcome, corrections, signals.get(STAGE, ())))
    return found


class PosedScene:
    """A scene in which one robot or several take the poses of a run."""

    def __init__(self, scenario: Scenario, robots: int = 1) -> None:
        robot = Robot.load()
        self._scene = engines.painter(scenario.table(RunParameters), robot, robots)
        self._scene.reset(0.0)
        self._shadow = Shadow(robot)

    def picture(
        self, truths: Sequence[GroundTruth], camera: Camera
    ) -> tuple[Image.Image, Image.Image]:
        """Return a picture of the robots with their shadows, and one that is white on the slope."""
        for body, truth in zip(self._scene.bodies, truths, strict=True):
            body.place(truth.position, matrix(truth.orientation), truth.joint_position.tolist())
        self._scene.tilt_ground(truths[0].inclination)
        image, slope = map(Image.fromarray, self._scene.picture(camera))
        for truth in truths:
            self._shadow.darken(image, slope, truth, camera)
        return image, slope

    def close(self) -> None:
        """Release the engine."""
        self._scene.close()
