"""``khr film``: a run as MP4 and GIF, or one frame of it.

A run folder holds its scenario, which is run again offline, bit for bit, and its trajectory hash
is compared. The pictures are drawn from the truths of that run by a second world, which only
poses: what is filmed cannot disturb what happens.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import degrees
from pathlib import Path

import imageio_ffmpeg  # type: ignore[import-untyped]
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from khr_balance.gait_parameters import GaitParameters
from khr_bringup.offline import ControlLoop, duration, run_offline
from khr_bringup.scenario import Scenario, load
from khr_bringup.strict_yaml import read_file, read_yaml
from khr_common import RunError
from khr_common.files import written
from khr_common.quoting import quoted
from khr_common.rotation import matrix
from khr_report.errors import ReportError
from khr_sim import engines
from khr_sim.camera import Camera, Picture
from khr_sim.robot import Robot
from khr_sim.run_parameters import RunParameters
from khr_sim.truth import Truth

INK, PAPER, TOE = (30, 34, 40), (255, 255, 255), (200, 60, 40)
MARGIN, FONT_SIZE = 12, 17  # px at a height of 480
FULL_SCALE = 1.0  # rad/s, of the pitch rate's trace
TRACE = 2.31  # s shown of it, one gait cycle
GIF_COLORS = 48
HALF_HEIGHT = 0.17  # m, from the feet to where the camera looks


@dataclass(frozen=True)
class Look:
    """How a film looks.

    Attributes:
        width, height: px.
        rate: frames per simulated second.
        yaw, pitch: where the camera looks, rad.
        distance: from the robot, m.
    """

    width: int = 640
    height: int = 480
    rate: float = 25.0
    yaw: float = 2.15
    pitch: float = -0.16
    distance: float = 1.1


@dataclass(frozen=True, eq=False)
class Frame:
    """One instant of a run with the robot's sensor readings."""

    truth: Truth
    pitch_rate: float
    foot_forces: tuple[float, ...]


def scenario_of(run: str) -> Scenario:
    """Return the scenario of a run folder, or the one of that name or file.

    Raises:
        ReportError: if there is neither.
    """
    folder = Path(run)
    if folder.is_dir():
        if not (folder / 'scenario.yaml').is_file():
            raise ReportError(f'{run}: no scenario.yaml in it; accepted: the folder of a run')
        return load(str(folder / 'scenario.yaml'))
    is_path = folder.name != run
    if is_path and not folder.exists():
        raise ReportError(f'{run}: no such run; accepted: the folder of a run, or a scenario')
    return load(run)


def frames(scenario: Scenario, run: str = '') -> list[Frame]:
    """Run a scenario offline and keep every instant.

    Args:
        scenario: what to run.
        run: its run folder, if it has one, to compare the trajectory hash with.

    Raises:
        RunError: if the trajectory differs from that of the folder.
    """
    kept: list[Frame] = []

    def keep(truth: Truth, loop: ControlLoop, _: object) -> None:
        kept.append(Frame(truth, loop.pitch_rate, tuple(truth.contact_force[:, 2].tolist())))

    result = run_offline(scenario, keep)
    outcome = Path(run) / 'outcome.json'
    if run and outcome.is_file():
        recorded = read_yaml(read_file(outcome), str(outcome))  # JSON is YAML too
        if not isinstance(recorded, dict) or 'trajectory_hash' not in recorded:
            raise ReportError(f'{outcome}: no outcome; accepted: the file that khr run writes')
        before = recorded['trajectory_hash']
        if recorded.get('end') != 'stopped' and before != result.trajectory_hash:
            raise RunError(
                f'{run}: the run did not repeat: trajectory hash {result.trajectory_hash}, '
                f'recorded {quoted(before)}; was it made with other versions?'
            )
    return kept


class PosedScene:
    """A camera, and a scene whose robot takes the poses of a run."""

    def __init__(self, scenario: Scenario, look: Look) -> None:
        self.look = look
        self._scene = engines.painter(scenario.table(RunParameters), Robot.load())
        self._scene.reset(0.0)

    def picture(self, truth: Truth) -> Picture:
        """Return a picture of the robot at an instant, (height, width, 3)."""
        self._scene.place(truth.position, matrix(truth.orientation), truth.joint_position.tolist())
        self._scene.tilt_ground(truth.inclination)
        # The camera follows the feet over the ground, not each motion of the torso.
        middle = truth.sole_position.mean(axis=0)
        target = (float(middle[0]), 0.0, float(middle[2]) + HALF_HEIGHT)
        look = self.look
        return self._scene.picture(
            Camera(look.width, look.height, target, look.yaw, look.pitch, look.distance)
        )

    def close(self) -> None:
        """Release the engine."""
        self._scene.close()


class Caption:
    """The text and curve drawn into the pictures of one run."""

    def __init__(self, scenario: Scenario, kept: list[Frame], look: Look) -> None:
        self._frames = kept
        self._look = look
        self._title = scenario.title or scenario.name
        self._period = scenario.table(RunParameters).control_period
        self._standing = scenario.table(GaitParameters).motion != 'walk'
        scale = look.height / 480.0
        self._margin = round(MARGIN * scale)
        self._font = ImageFont.load_default(round(FONT_SIZE * scale))

    def draw(self, picture: Picture, index: int) -> Image.Image:
        """Return the picture of frame ``index`` with its caption."""
        image = Image.fromarray(picture)
        pen = ImageDraw.Draw(image)
        frame = self._frames[index]
        line = self._font.getbbox('Ag')[3] + 4
        words = (
            f'phi {degrees(frame.truth.inclination):.2f} deg',
            f't {frame.truth.stamp_ns / 1e9:.2f} s',
            self._measured(frame),
        )
        for row, text in enumerate((self._title, '   '.join(words))):
            pen.text((self._margin, self._margin + row * line), text, INK, self._font)
        self._trace(pen, index)
        return image

    def _measured(self, frame: Frame) -> str:
        if self._standing:
            l_toe, l_heel, r_toe, r_heel = frame.foot_forces
            return f'Delta {l_toe + r_toe - l_heel - r_heel:+.1f} N'
        return f'pitch rate {frame.truth.mean_angular_velocity[1]:+.2f} rad/s'

    def _trace(self, pen: ImageDraw.ImageDraw, index: int) -> None:
        """Draw the torso's pitch rate over the last gait cycle along the bottom."""
        left, right = self._margin, self._look.width - self._margin
        bottom = self._look.height - self._margin
        height = self._look.height // 8
        middle = bottom - height // 2
        count = round(TRACE / self._period)
        shown = self._frames[max(0, index - count) : index + 1]
        points = [
            (
                right - (len(shown) - 1 - i) * (right - left) / count,
                middle
                - max(-1.0, min(1.0, float(one.truth.mean_angular_velocity[1]) / FULL_SCALE))
                * height
                / 2.0,
            )
            for i, one in enumerate(shown)
        ]
        pen.line([(left, middle), (right, middle)], (170, 174, 180))
        if len(points) > 1:
            pen.line(points, TOE, 2)
        pen.text(
            (left, bottom - height),
            f'pitch rate, {TRACE} s, +-{FULL_SCALE:g} rad/s',
            (110, 114, 120),
            self._font,
        )


def render_run(
    run: str,
    out: Path | None = None,
    still: float | None = None,
    part: tuple[float, float | None] = (0.0, None),
    size: tuple[int, int, float] = (640, 480, 25.0),
) -> list[Path]:
    """Render a run to MP4 and GIF, or one picture of it to PNG; return the files.

    Args:
        run: a run folder, or a scenario file or name.
        out: the files' path, with or without a suffix; by default in the run folder, or here by
            the scenario's name.
        still: time of the one picture, s.
        part: start and end of the film, s.
        size: width and height in px, pictures per s.

    Raises:
        ReportError: if an argument is not accepted or the files cannot be written.
        RunError: if the run does not repeat.
    """
    look = _look(*size)
    scenario = scenario_of(run)
    _within(duration(scenario), still, part)
    base = _base(run, scenario, out)
    _writable(base)
    kept = frames(scenario, run)
    times = np.array([frame.truth.stamp_ns / 1e9 for frame in kept])
    if still is not None:
        if not 0.0 <= still <= times[-1]:
            raise ReportError(
                f'--still: {still:g} is not accepted; accepted: [0, {times[-1]:g}] s'
            )
        nearest = int(np.argmin(np.abs(times - still)))
        (picture,) = _pictures(scenario, kept, [nearest], look)
        picture.save(f'{base}.png', optimize=True)
        return [Path(f'{base}.png')]
    start, end = part
    wanted = np.arange(start, min(times[-1] if end is None else end, times[-1]), 1.0 / look.rate)
    if start < 0.0 or not len(wanted):
        raise ReportError(
            f'--start {start:g}, --end {end}: nothing to show; accepted: a part '
            f'of [0, {times[-1]:g}] s'
        )
    picked = np.searchsorted(times, wanted).tolist()
    pictures = list(_pictures(scenario, kept, picked, look))
    movie, animation = Path(f'{base}.mp4'), Path(f'{base}.gif')
    with written(movie) as file:
        _save_movie(file, pictures, look)
    with written(animation) as file:
        _save_gif(file, pictures, look.rate)
    return [movie, animation]


def _pictures(
    scenario: Scenario, kept: list[Frame], picked: list[int], look: Look
) -> Iterator[Image.Image]:
    world, caption = PosedScene(scenario, look), Caption(scenario, kept, look)
    try:
        for index in picked:
            yield caption.draw(world.picture(kept[index].truth), index)
    finally:
        world.close()


def _within(longest: float, still: float | None, part: tuple[float, float | None]) -> None:
    """Check the times against the length of the run before it is repeated."""
    for name, time in (('still', still), ('start', part[0]), ('end', part[1])):
        if time is not None and not 0.0 <= time <= longest:
            raise ReportError(f'--{name}: {time:g} is not accepted; accepted: [0, {longest:g}] s')
    if part[1] is not None and part[1] <= part[0]:
        raise ReportError(
            f'--end: {part[1]:g} is not accepted; accepted: after --start, '
            f'({part[0]:g}, {longest:g}] s'
        )


def _look(width: int, height: int, rate: float) -> Look:
    for name, value in (('width', width), ('height', height)):
        if not 64 <= value <= 1920 or value % 2:
            raise ReportError(
                f'--{name}: {value} is not accepted; accepted: even integer in [64, 1920] px'
            )
    if not 1.0 <= rate <= 60.0:
        raise ReportError(f'--rate: {rate:g} is not accepted; accepted: [1, 60] per s')
    return Look(width, height, rate)


def _save_movie(path: Path, pictures: list[Image.Image], look: Look) -> None:
    writer = imageio_ffmpeg.write_frames(
        str(path), (look.width, look.height), fps=look.rate, macro_block_size=2, quality=7
    )
    writer.send(None)
    for picture in pictures:
        writer.send(np.asarray(picture).tobytes())
    writer.close()


def _save_gif(path: Path, pictures: list[Image.Image], rate: float) -> None:
    # With one palette for all frames a GIF stores only moving parts and does not flicker.
    palette = pictures[len(pictures) // 2].quantize(GIF_COLORS, Image.Quantize.MEDIANCUT)
    first, *rest = [
        picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures
    ]
    first.save(
        path,
        save_all=True,
        append_images=rest,
        duration=round(1000.0 / rate),
        loop=0,
        optimize=True,
    )


def _base(run: str, scenario: Scenario, out: Path | None) -> Path:
    if out is not None:  # names contain degrees with decimals, so only these count as suffixes
        return out.with_suffix('') if out.suffix in ('.mp4', '.gif', '.png') else out
    folder = Path(run)
    return folder / 'film' if folder.is_dir() else Path(scenario.name)


def _writable(path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ReportError(
            f'--out: {str(path)!r}: {error.strerror}; accepted: a path in a '
            'folder that can be written'
        ) from error
