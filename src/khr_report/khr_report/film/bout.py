"""``khr film`` of a bout: both robots in one picture, their state, and the decision."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import cos, pi, sin
from pathlib import Path

import numpy as np
from PIL import Image, ImageChops, ImageDraw, ImageFont

from khr_analysis.outcome import Outcome
from khr_analysis.referee import DRAW, RED, ROBOTS
from khr_bringup.bout.bout import Bout, load_bout
from khr_bringup.bout.offline import Influences, run_bout
from khr_bringup.bout.recorded import influences_on, recorded_bout
from khr_bringup.bout.result import BoutResult
from khr_bringup.offline import Loops, Truths
from khr_bringup.scenario.control_text import control_of
from khr_common import RunError
from khr_report.film.film import SMOOTH, Show, base_of, look_of, part_of, render, within
from khr_report.film.overlay import FAINT, INK, PAPER, SMALL
from khr_report.film.scene import Look, PosedScene
from khr_sim.physics.camera import Camera
from khr_sim.physics.truth import GroundTruth

COLORS = {'red': (190, 40, 40), 'blue': (31, 64, 158), DRAW: (110, 110, 110)}
HEIGHT, MARGIN, LARGE = 720, 18, 30  # px, of a picture in which sizes below hold
PITCH, FARTHEST, NEAREST = -0.22, 2.6, 1.2  # rad; m from the camera to the middle
ENDING = 1.0  # s that the last picture of a round stays


@dataclass(frozen=True, eq=False)
class Frame:
    """One sample of a bout."""

    time: float  # from the start of the first round, s
    number: int  # of the round, from 0
    truths: Mapping[str, GroundTruth]
    outcomes: Mapping[str, Outcome]


def render_bout(
    name: str,
    out: Path | None,
    still: float | None,
    part: tuple[float, float | None],
    size: tuple[int, int, float],
    show: Show,
) -> list[Path]:
    """Render a bout to MP4 and GIF, or one picture of it to PNG; return the files.

    Args:
        name: the folder of a bout, or a bout file or name.
        out, still, part, size, show: as of :func:`khr_report.film.film.render_run`.

    Raises:
        KhrError: if an argument is not accepted or the files cannot be written.
        RunError: if a recorded bout does not repeat.
    """
    look = replace(look_of(*size), yaw=pi / 2.0, pitch=PITCH)
    folder, hashes = Path(name), None
    influences: Mapping[tuple[int, str], Influences] = {}
    if folder.is_dir():
        bout, ended = recorded_bout(folder)
        hashes = [each['trajectory_hash'] for each in ended['rounds']]
        influences = influences_on(bout, folder, len(hashes))
    else:
        bout = load_bout(name)
    within(bout.rules.rounds * bout.rules.time_limit, still, part)
    kept: list[Frame] = []
    shown = part_of(f'repeating {name}', bout.rules.time_limit * bout.rules.rounds, show)

    def keep(number: int, before: float, truths: Truths, loops: Loops) -> None:
        outcomes = {robot: loop.outcome for robot, loop in loops.items() if loop.outcome}
        time = before + number * ENDING + truths[RED].stamp_ns / 1e9
        kept.append(Frame(time, number, dict(truths), outcomes))
        shown(time)

    result = run_bout(bout, keep, influences)
    if hashes is not None and hashes != [each.trajectory_hash for each in result.rounds]:
        raise RunError(f'{name}: the bout did not repeat; was it made with other versions?')
    last = kept[-1].time + ENDING
    base = base_of(name, bout.name, out)
    return render(
        base, last, lambda times: _pictures(result, kept, times, look), look, still, part, show
    )


def _pictures(
    result: BoutResult, kept: Sequence[Frame], times: Sequence[float], look: Look
) -> Iterator[Image.Image]:
    """Draw the bout at each time."""
    width, height = round(look.width * SMOOTH), round(look.height * SMOOTH)
    scene = PosedScene(result.bout.robots[RED], len(ROBOTS))
    try:
        for time in times:
            index = bisect_left(kept, time - 1e-9, key=lambda frame: frame.time)
            # Between two rounds the last picture of the first stays.
            new_round = 0 < index < len(kept) and kept[index].number != kept[index - 1].number
            frame = kept[min(index - new_round, len(kept) - 1)]
            camera = _camera(replace(look, width=width, height=height), frame)
            image, mask = scene.picture(list(frame.truths.values()), camera)
            _draw_ring(image, mask, result.bout, camera)
            _write_state(image, result, frame)
            yield image.resize((look.width, look.height), Image.Resampling.LANCZOS)
    finally:
        scene.close()


def _camera(look: Look, frame: Frame) -> Camera:
    """Return a camera that has both robots in its picture."""
    places = np.array([truth.position for truth in frame.truths.values()])
    x, y, _ = places.mean(axis=0).tolist()
    apart = float(np.ptp(places[:, 0]))
    distance = min(max(NEAREST, 0.9 + 1.6 * apart), FARTHEST)
    return Camera(look.width, look.height, (x, y, 0.13), look.yaw, look.pitch, distance)


def _draw_ring(image: Image.Image, mask: Image.Image, bout: Bout, camera: Camera) -> None:
    """Draw the edge of the ring on level ground, behind the robots."""
    radius = bout.rules.ring_width / 2.0 / cos(pi / 8.0)
    corners = [((n + 0.5) * pi / 4.0) for n in range(9)]
    edge = np.array([(radius * cos(a), radius * sin(a), 0.0) for a in corners])
    points = np.concatenate([np.linspace(start, end, 24) for start, end in pairwise(edge)])
    depth = (np.column_stack([points, np.ones(len(points))]) @ camera.view().T)[:, 2]
    seen = depth < -0.2  # ahead of the camera
    pixels = camera.pixels(points)
    line = Image.new('L', image.size)
    pen = ImageDraw.Draw(line)
    for n in range(len(points) - 1):
        if seen[n] and seen[n + 1]:
            ends = [*pixels[n].tolist(), *pixels[n + 1].tolist()]
            pen.line(ends, 255, max(1, image.height // 360))
    image.paste(INK, (0, 0), ImageChops.logical_and(line.convert('1'), mask.convert('1')))


def _write_state(image: Image.Image, result: BoutResult, frame: Frame) -> None:
    scale = image.height / HEIGHT
    large, small = (ImageFont.load_default(round(size * scale)) for size in (LARGE, SMALL))
    pen, margin = ImageDraw.Draw(image, 'RGBA'), MARGIN * scale
    title = result.bout.title or result.bout.name
    size = round(LARGE * scale)
    while pen.textlength(title, ImageFont.load_default(size)) > image.width - 2 * margin:
        size -= 1
    pen.text((margin, margin), title, INK, ImageFont.load_default(size))
    line = 1.4 * SMALL * scale
    begun = frame.truths[RED].stamp_ns / 1e9
    for number, robot in enumerate(ROBOTS):
        outcome = frame.outcomes[robot]
        down = '' if outcome.fell_at is None else f': down for {begun - outcome.fell_at:.1f} s'
        text = f'{robot}, {control_of(result.bout.robots[robot])}{down}'
        pen.text(
            (margin, margin + 1.4 * LARGE * scale + number * line), text, COLORS[robot], small
        )
    clock = f't {begun:.2f} s' + (
        f', round {frame.number + 1}' if result.bout.rules.rounds > 1 else ''
    )
    right, bottom = image.width - margin, image.height - margin
    pen.text((right, bottom), clock, FAINT, small, anchor='rb')
    ended = result.rounds[frame.number].decision
    if begun >= ended.time - 1e-9:
        won = DRAW if ended.winner == DRAW else f'{ended.winner} wins'
        text, pad = f'{won}: {ended.reason}', 6 * scale
        width = pen.textlength(text, large)
        box = (right - width - 2 * pad, bottom - 2.6 * LARGE * scale)
        corner = (right, box[1] + LARGE * scale + 2 * pad)
        pen.rounded_rectangle((*box, *corner), pad, COLORS[ended.winner])
        pen.text((right - pad, (box[1] + corner[1]) / 2.0), text, PAPER, large, anchor='rm')
