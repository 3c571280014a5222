"""Overlay of a film: control, balance, measured signals and outcome."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, cos, degrees, nan, radians, sin
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.balance import Balance, BalanceModel
from khr_bringup.changes import Change
from khr_bringup.recorded.run_signals import constant_parts
from khr_bringup.scenario.control_text import control_of
from khr_bringup.scenario.derived import swings
from khr_bringup.scenario.scenario import Scenario
from khr_common.rotation import Array, matrix, pitch_of, pitched
from khr_description.robot import Robot
from khr_report.film.scene import Frame
from khr_sim.physics.camera import Camera
from khr_sim.run_parameters import RunParameters

INK, FAINT, PAPER = (30, 34, 40), (120, 124, 130), (255, 255, 255)
LEFT, RIGHT = (0, 114, 178), (213, 94, 0)  # of the feet, as in figures
MASS, PRESSURE = (204, 121, 167), (0, 158, 115)  # as on the page
POINTS = (  # of the balance: name, colour, attribute
    ('centre of mass', MASS, 'below'),
    ('capture point', RIGHT, 'capture'),
    ('centre of pressure', PRESSURE, 'pressure'),
)
SHOWN = GaitParameters().cycle_period  # s
OTHERS = (LEFT, RIGHT, PRESSURE, MASS)  # of other lines
SMALL = 20  # px, size of the text
RADIUS = 7  # px of a point
ACROSS = 0.32  # m of way that the view from above is wide
LINE = (205, 208, 212)

Color = tuple[int, int, int]
Pen = ImageDraw.ImageDraw
Box = tuple[float, float, float, float]
Swings = Mapping[str, Sequence[tuple[float, float]]]  # of the feet, s, by side
TRACE = (20, 60, 140)
VERDICTS = {
    'walked': (0, 130, 90), 'stood': (0, 130, 90), 'slipped': (190, 130, 0), 'fell': (190, 40, 40),
}  # fmt: skip
FORCES = (('left toe', LEFT), ('left heel', LEFT), ('right toe', RIGHT), ('right heel', RIGHT))
# that a GIF must not blend
COLORS = (INK, PAPER, TRACE, LEFT, RIGHT, MASS, PRESSURE, *VERDICTS.values())
HEIGHT = 720  # px, of a picture in which sizes below hold
MARGIN, LARGE, PANEL = 18, 30, 112
WIDE = 300  # px, of the panel of the corrections
ABOVE = (180, 160)  # px, of the view from above
FULL_FORCE = 20.0  # N; the robot weighs 15
FULL_RATE = 60.0  # deg/s
FULL_PLACE = 120.0  # mm
LEAST = 5.0  # deg, of the scale of the corrections
LEVEL = 0.3  # of the width, length of the level line
FLAT = radians(0.05)  # an inclination that is not drawn


@dataclass(frozen=True)
class Brush:
    """A pen, the font of small texts, and the px for each px of a picture 720 px high."""

    pen: Pen
    font: Any
    scale: float

    def panel(self, box: Box) -> None:
        """Draw the background of a panel."""
        self.pen.rounded_rectangle(box, 6 * self.scale, (*PAPER, 205))

    def point(self, x: float, y: float, color: Color) -> None:
        """Draw a point of the balance."""
        r = RADIUS * self.scale
        self.pen.ellipse((x - r, y - r, x + r, y + r), color, PAPER)


@dataclass(frozen=True, eq=False)
class OverTime:
    """Lines over the last gait cycle, with their scale, and the swings of the feet as shading."""

    title: Sequence[tuple[str, Color]]  # texts and their colours
    full: float  # value at the upper edge, and negative at the lower edge
    time: Array  # s, (N,)
    lines: Sequence[tuple[Color, Array]]  # colour and values, (N,), of each
    swings: Swings

    def draw(self, brush: Brush, box: Box, now: float) -> None:
        """Draw it at a time, s."""
        brush.panel(box)
        pen, scale = brush.pen, brush.scale
        left, top, right, bottom = box
        pad = 8 * scale
        start, end = left + pad, right - 58 * scale
        high, low = top + 1.5 * SMALL * scale, bottom - pad
        middle, half = (high + low) / 2.0, (low - high) / 2.0

        def across(time: Array) -> Array:
            return end - np.clip((now - time) / SHOWN, 0.0, 1.0) * (end - start)

        for color, side in ((LEFT, 'left'), (RIGHT, 'right')):
            for swing in self.swings.get(side, ()):
                x, x_end = across(np.array(swing)).tolist()
                if x < x_end:
                    pen.rectangle((x, high, x_end, low), (*color, 30))
        for value in (-self.full, 0.0, self.full):
            y = middle - half * value / self.full
            pen.line((start, y, end, y), LINE, max(1, round(scale)))
            label = f'{value:+.0f}' if value else '0'
            pen.text((end + pad / 2.0, y), label, FAINT, brush.font, anchor='lm')
        inside = (self.time > now - SHOWN) & (self.time < now + 1e-6)
        for color, values in self.lines:
            down = middle - half * np.clip(values[inside] / self.full, -1.0, 1.0)
            known = np.isfinite(down)
            points = np.column_stack([across(self.time[inside]), down])[known]
            if len(points) > 1:
                flat = [tuple(each) for each in points.tolist()]
                pen.line(flat, color, max(1, round(2 * scale)), joint='curve')
        x = start
        for text, color in self.title:
            pen.text((x, top + pad / 2.0), text, color, brush.font)
            x += pen.textlength(text, brush.font)


def draw_from_above(brush: Brush, box: Box, balance: Balance) -> None:
    """Draw the loaded soles and the points of the balance from above, ahead to the right."""
    brush.panel(box)
    left, top, right, bottom = box
    corners = balance.support if len(balance.support) else balance.below[np.newaxis]
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
    size = (right - left) / ACROSS

    def place(point: Array) -> tuple[float, float]:
        ahead, aside = (balance.axes @ (point - middle)).tolist()
        x = (left + right) / 2.0 + size * ahead
        return x, (top + bottom + SMALL * brush.scale) / 2.0 - size * aside

    if len(balance.support):
        outline = [place(corner) for corner in balance.support]
        brush.pen.polygon(outline, (*LINE, 160), FAINT)
    for _, color, name in POINTS:
        point = getattr(balance, name)
        if np.isfinite(point).all():
            x, y = place(point)
            inside = min(max(x, left), right), min(max(y, top), bottom)
            brush.point(*inside, color)
    at = left + 8 * brush.scale, top + 4 * brush.scale
    brush.pen.text(at, 'from above', FAINT, brush.font)


class Overlay:
    """Text, level line, balance, forces and pitch rate over the pictures of one run."""

    def __init__(
        self,
        scenario: Scenario,
        kept: Sequence[Frame],
        height: int,
        changes: Sequence[Change] = (),
    ) -> None:
        self._scale = height / HEIGHT
        self._large, self._small = (
            ImageFont.load_default(max(6, round(size * self._scale))) for size in (LARGE, SMALL)
        )
        self._controls = [(0.0, control_of(scenario))]
        changed = scenario
        for each in sorted(changes, key=lambda change: change.time):
            changed = changed.changed({(each.node, each.parameter): each.value})
            self._controls.append((each.time, control_of(changed)))
        motion = scenario.table(GaitParameters)
        self._what = f'{motion.label}, {scenario.table(RunParameters).surface}'
        self._outcome = kept[-1].outcome
        self._time = np.array([frame.time for frame in kept])
        self._balances = _balances(scenario, kept)
        swung = swings(motion)
        self._over_time = _panels(self._time, kept, self._balances, swung)
        self._corrections = _corrections(scenario, changes, self._time, kept, swung)

    def draw(self, image: Image.Image, frame: Frame, camera: Camera) -> None:
        """Draw over the picture of a frame."""
        pen = ImageDraw.Draw(image, 'RGBA')
        brush = Brush(pen, self._small, self._scale)
        margin, line = MARGIN * self._scale, 1.3 * SMALL * self._scale
        right, bottom = image.width - margin, image.height - margin
        top = margin + 1.3 * LARGE * self._scale
        control = [text for time, text in self._controls if time <= frame.time][-1]
        number = min(int(np.searchsorted(self._time, frame.time)), len(self._balances) - 1)
        balance = self._balances[number]
        pen.text((margin, margin), control, INK, self._large)
        pen.text((margin, top), self._what, FAINT, self._small)
        self._points(brush, balance, camera, (margin, top + line))
        start = top + 2.5 * line
        width, height = ABOVE[0] * self._scale, ABOVE[1] * self._scale
        box = margin, start, margin + width, start + height
        draw_from_above(brush, box, balance)
        self._verdict(pen, right, margin)
        lean = pitch_of(*frame.truth.orientation.tolist())
        clock = f'lean {degrees(lean):.1f} deg   t {frame.time:.2f} s'
        pen.text((right, top + line / 2.0), clock, INK, self._small, anchor='ra')
        if self._corrections is not None:
            above = margin + (LARGE + 2.5 * SMALL) * self._scale
            box = right - WIDE * self._scale, above, right, above + PANEL * self._scale
            self._corrections.draw(brush, box, frame.time)
        self._level(pen, frame, camera)
        up, gap = bottom - PANEL * self._scale, margin / 2.0
        width = (right - margin - 2.0 * gap) / 3.0
        lefts = [margin + n * (width + gap) for n in range(3)]
        self._forces(brush, (lefts[0], up, lefts[0] + width, bottom), frame)
        for left, panel in zip(lefts[1:], self._over_time, strict=True):
            panel.draw(brush, (left, up, left + width, bottom), frame.time)

    def _points(
        self, brush: Brush, balance: Balance, camera: Camera, legend: tuple[float, float]
    ) -> None:
        """Draw centre of mass, capture point and centre of pressure on the slope, and name them."""
        radius = RADIUS * self._scale
        x, y = legend[0] + radius, legend[1] + SMALL * self._scale / 2.0
        for name, color, point in POINTS:
            brush.point(x, y, color)
            brush.pen.text((x + 2 * radius, y), name, FAINT, self._small, anchor='lm')
            x += 4 * radius + brush.pen.textlength(name, self._small)
            place = getattr(balance, point)
            if np.isfinite(place).all():
                u, v = camera.pixels(place).tolist()
                if point == 'below':  # its vertical, from the centre of mass itself
                    x_top, y_top = camera.pixels(balance.center_of_mass).tolist()
                    brush.pen.line((x_top, y_top, u, v), color, max(1, round(2 * self._scale)))
                    brush.point(x_top, y_top, color)
                brush.point(u, v, color)

    def _verdict(self, pen: Pen, right: float, top: float) -> None:
        outcome, pad = self._outcome, 6 * self._scale
        fell = '' if outcome.fell_at is None else f' at {outcome.fell_at:.2f} s'
        text = outcome.verdict + fell
        width = pen.textlength(text, self._large)
        box = (right - width - 2 * pad, top - pad, right, top + LARGE * self._scale + pad)
        pen.rounded_rectangle(box, pad, VERDICTS[outcome.verdict])
        pen.text((right - pad, (box[1] + box[3]) / 2.0), text, PAPER, self._large, anchor='rm')

    def _level(self, pen: Pen, frame: Frame, camera: Camera) -> None:
        """Draw a level line from the surface of the slope, and the angle between them."""
        phi = frame.truth.inclination
        text = f'phi {degrees(phi):.2f} deg'
        # The corner lies uphill of the feet, on the surface under the middle of the robot.
        uphill = -1.0 if phi >= 0.0 else 1.0
        along = matrix(pitched(phi))[:, 0]
        feet = frame.truth.sole_position.mean(axis=0) @ along
        x, y = camera.pixels((feet + uphill * 0.33) * along).tolist()
        reach = -uphill * LEVEL * camera.width
        width = max(1, round(1.5 * self._scale))
        if abs(phi) > FLAT:
            for start in range(0, 30, 2):  # dashes
                ends = (x + reach * start / 30.0, y, x + reach * (start + 1) / 30.0, y)
                pen.line(ends, INK, width)
            edge = (x + reach, y + abs(reach) * abs(np.tan(phi)))
            pen.line((x, y, *edge), INK, width)
            angles = np.linspace(0.0, abs(phi), 16)
            radius = 0.85 * abs(reach)
            turned = [(x - uphill * radius * cos(a), y + radius * sin(a)) for a in angles]
            pen.line(turned, INK, width)
        anchor = 'lb' if uphill < 0.0 else 'rb'
        pen.text((x, y - 6 * self._scale), text, INK, self._small, anchor=anchor)

    def _forces(self, brush: Brush, box: Box, frame: Frame) -> None:
        """Draw the normal forces of the ground as bars."""
        brush.panel(box)
        pen = brush.pen
        left, top, right, bottom = box
        pad, row = 8 * self._scale, (bottom - top) / 4.0
        start, end = left + 112 * self._scale, right - 72 * self._scale
        forces = frame.truth.contact_force[:, 2].tolist()
        for number, ((name, color), force) in enumerate(zip(FORCES, forces, strict=True)):
            y = top + (number + 0.5) * row
            pen.text((left + pad, y), name, INK, self._small, anchor='lm')
            pen.text((right - pad, y), f'{force:.1f} N', INK, self._small, anchor='rm')
            tip = start + max(0.0, end - start) * min(1.0, max(0.0, force) / FULL_FORCE)
            pen.rectangle((start, y - 0.3 * row, max(tip, start), y + 0.3 * row), color)


def _balances(scenario: Scenario, kept: Sequence[Frame]) -> list[Balance]:
    model = BalanceModel(Robot.load(), scenario.table(RunParameters))
    found: list[Balance] = []
    earlier = 0.0
    for each in kept:
        truth, last = each.truth, found[-1] if found else None
        pose = (*truth.position, *truth.orientation)
        angles, forces = truth.joint_position.tolist(), truth.contact_force[:, 2].tolist()
        step = each.time - earlier
        found.append(model.at(pose, angles, truth.inclination, forces, last, step))
        earlier = each.time
    return found


def _panels(
    time: Array, kept: Sequence[Frame], balances: Sequence[Balance], swung: Swings
) -> tuple[OverTime, OverTime]:
    """Return the panels of the balance and of the pitch rate over time."""
    places = 1e3 * np.array([each.margins for each in balances])
    colors = MASS, RIGHT, PRESSURE, FAINT, FAINT  # as of Margins
    title = [('balance and edges, mm', FAINT)]
    balance = OverTime(title, FULL_PLACE, time, list(zip(colors, places.T, strict=True)), swung)
    gyro = np.degrees([frame.pitch_rate for frame in kept])
    true = np.degrees([frame.truth.mean_angular_velocity[1] for frame in kept])
    title = [('pitch rate, deg/s: ', FAINT), ('gyro', TRACE), (', ', FAINT), ('true', PRESSURE)]
    return balance, OverTime(title, FULL_RATE, time, [(PRESSURE, true), (TRACE, gyro)], swung)


def _corrections(
    scenario: Scenario,
    changes: Sequence[Change],
    time: Array,
    kept: Sequence[Frame],
    swung: Swings,
) -> OverTime | None:
    """Return the panel of the corrections with their constant parts; None without a correction."""
    names = [*scenario.corrections]
    found = np.array([each.corrections or [nan] * len(names) for each in kept], dtype=float)
    if not np.nan_to_num(found).any():
        return None
    parts = constant_parts(scenario, changes, time, np.array([each.stage for each in kept]))
    looks = zip(names, OTHERS, found.T, parts.T, strict=False)
    acting = [each for each in looks if np.nan_to_num(each[2]).any()]
    lines = [(FAINT, np.degrees(part)) for *_, part in acting if part.any()]
    constant = [('constant', FAINT)] * bool(lines)
    lines += [(color, np.degrees(values)) for _, color, values, _ in acting]
    largest = max(float(np.nanmax(np.abs(values))) for _, values in lines)
    # several names leave no room for the word
    title = [('correction, deg: ' if len(acting) == 1 else 'deg: ', FAINT)]
    title += [(f'{name} ', color) for name, color, *_ in acting] + constant
    return OverTime(title, LEAST * ceil(max(largest / LEAST, 1.0)), time, lines, swung)
