"""Overlay of a film: control, measured signals and outcome."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, degrees, radians, sin

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.balance import BalanceModel
from khr_bringup.changes import Change
from khr_bringup.scenario.control_text import control_of
from khr_bringup.scenario.scenario import Scenario
from khr_common.maths.rotation import matrix, pitched
from khr_description.robot import Robot
from khr_report.film.scene import Frame
from khr_sim.physics.camera import Camera
from khr_sim.run_parameters import RunParameters

INK, FAINT, PAPER, TRACE = (30, 34, 40), (120, 124, 130), (255, 255, 255), (20, 60, 140)
LEFT, RIGHT = (0, 114, 178), (213, 94, 0)  # of the feet, as in figures
MASS, PRESSURE = (204, 121, 167), (0, 158, 115)  # as on the page
VERDICTS = {
    'walked': (0, 130, 90), 'stood': (0, 130, 90), 'slipped': (190, 130, 0), 'fell': (190, 40, 40),
}  # fmt: skip
FORCES = (('left toe', LEFT), ('left heel', LEFT), ('right toe', RIGHT), ('right heel', RIGHT))
COLORS = (INK, PAPER, TRACE, LEFT, RIGHT, *VERDICTS.values())  # that a GIF must not blend
HEIGHT = 720  # px, of a picture in which sizes below hold
MARGIN, LARGE, SMALL, PANEL = 18, 30, 20, 112
FULL_FORCE = 20.0  # N; the robot weighs 15
FULL_RATE = 60.0  # deg/s
SHOWN = GaitParameters().cycle_period  # s of the pitch rate
LEVEL = 0.3  # of the width, length of the level line
FLAT = radians(0.05)  # an inclination that is not drawn

Pen = ImageDraw.ImageDraw
Box = tuple[float, float, float, float]


class Overlay:
    """Text, level line, forces and pitch rate over the pictures of one run."""

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
        self._kept = kept
        self._balance = BalanceModel(Robot.load(), scenario.table(RunParameters))
        motion = scenario.table(GaitParameters).label
        self._what = f'{motion}, {scenario.table(RunParameters).surface}'
        self._outcome = kept[-1].outcome
        self._time = np.array([frame.time for frame in kept])
        self._rate = np.degrees([frame.pitch_rate for frame in kept])

    def draw(self, image: Image.Image, frame: Frame, camera: Camera) -> None:
        """Draw over the picture of a frame."""
        pen = ImageDraw.Draw(image, 'RGBA')
        margin, line = MARGIN * self._scale, 1.3 * SMALL * self._scale
        right, bottom = image.width - margin, image.height - margin
        top = margin + 1.3 * LARGE * self._scale
        control = [text for time, text in self._controls if time <= frame.time][-1]
        pen.text((margin, margin), control, INK, self._large)
        self._points(pen, frame, camera, (margin, top + line))
        pen.text((margin, top), self._what, FAINT, self._small)
        self._verdict(pen, right, margin)
        clock = f't {frame.time:.2f} s'
        pen.text((right, top + line / 2.0), clock, INK, self._small, anchor='ra')
        self._level(pen, frame, camera)
        up, middle = bottom - PANEL * self._scale, image.width * 0.44
        self._forces(pen, (margin, up, middle, bottom), frame)
        self._pitch_rate(pen, (middle + margin, up, right, bottom), frame.time)

    def _points(self, pen: Pen, frame: Frame, camera: Camera, legend: tuple[float, float]) -> None:
        """Draw centre of mass, capture point and centre of pressure on the slope, and name them."""
        number = int(np.searchsorted(self._time, frame.time))
        before, balance, earlier = self._kept[max(number - 1, 0)], None, 0.0
        for each in (before, frame):
            truth = each.truth
            balance = self._balance.at(
                (*truth.position, *truth.orientation),
                truth.joint_position.tolist(),
                truth.inclination,
                truth.contact_force[:, 2].tolist(),
                balance,
                each.time - earlier,
            )
            earlier = each.time
        assert balance is not None
        radius, x = 7 * self._scale, legend[0] + 7 * self._scale
        for name, color, place in (
            ('centre of mass', MASS, balance.below),
            ('capture point', RIGHT, balance.capture),
            ('centre of pressure', PRESSURE, balance.pressure),
        ):
            y = legend[1] + SMALL * self._scale / 2.0
            pen.ellipse((x - radius, y - radius, x + radius, y + radius), color, PAPER)
            pen.text((x + 2 * radius, y), name, FAINT, self._small, anchor='lm')
            x += 4 * radius + pen.textlength(name, self._small)
            if np.isfinite(place).all():
                u, v = camera.pixels(place).tolist()
                pen.ellipse((u - radius, v - radius, u + radius, v + radius), color, PAPER)

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

    def _panel(self, pen: Pen, box: Box) -> None:
        pen.rounded_rectangle(box, 6 * self._scale, (*PAPER, 205))

    def _forces(self, pen: Pen, box: Box, frame: Frame) -> None:
        """Draw the normal forces of the ground as bars."""
        self._panel(pen, box)
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

    def _pitch_rate(self, pen: Pen, box: Box, now: float) -> None:
        """Draw the pitch rate over the last gait cycle, with its scale."""
        self._panel(pen, box)
        left, top, right, bottom = box
        pad = 8 * self._scale
        start, end = left + pad, right - 58 * self._scale
        high, low = top + 1.5 * SMALL * self._scale, bottom - pad
        middle, half = (high + low) / 2.0, (low - high) / 2.0
        for value in (-FULL_RATE, 0.0, FULL_RATE):
            y = middle - half * value / FULL_RATE
            pen.line((start, y, end, y), (205, 208, 212), max(1, round(self._scale)))
            pen.text((end + pad / 2.0, y), f'{value:+.0f}' if value else '0', FAINT, self._small,
                     anchor='lm')  # fmt: skip
        inside = (self._time > now - SHOWN) & (self._time < now + 1e-6)
        across = end - (now - self._time[inside]) * (end - start) / SHOWN
        down = middle - half * np.clip(self._rate[inside] / FULL_RATE, -1.0, 1.0)
        points = list(zip(across.tolist(), down.tolist(), strict=True))
        if len(points) > 1:
            pen.line(points, TRACE, max(1, round(2.5 * self._scale)), joint='curve')
        text = f'pitch rate (gyro), deg/s, last {SHOWN} s'
        pen.text((start, top + pad / 2.0), text, FAINT, self._small)
