"""Panels of a film: lines over the last gait cycle, and the balance from above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import Any

import numpy as np
from PIL import ImageDraw

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.balance import Balance
from khr_common.rotation import Array

INK, FAINT, PAPER = (30, 34, 40), (120, 124, 130), (255, 255, 255)
LEFT, RIGHT = (0, 114, 178), (213, 94, 0)  # of the feet, as in figures
MASS, PRESSURE = (204, 121, 167), (0, 158, 115)  # as on the page
POINTS = (  # of the balance: name, colour, attribute
    ('centre of mass', MASS, 'below'),
    ('capture point', RIGHT, 'capture'),
    ('centre of pressure', PRESSURE, 'pressure'),
)
SHOWN = GaitParameters().cycle_period  # s
OTHERS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167))  # of other lines
SMALL = 20  # px, size of the text
RADIUS = 7  # px of a point
ACROSS = 0.32  # m of way that the view from above is wide
LINE = (205, 208, 212)

Color = tuple[int, int, int]
Pen = ImageDraw.ImageDraw
Box = tuple[float, float, float, float]
Swings = Mapping[str, Sequence[tuple[float, float]]]  # of the feet, s, by side


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


def draw_from_above(brush: Brush, box: Box, balance: Balance, inclination: float) -> None:
    """Draw the loaded soles and the points of the balance from above, forward to the right."""
    brush.panel(box)
    left, top, right, bottom = box
    ahead = np.array([cos(inclination), 0.0, -sin(inclination)])
    corners = balance.support if len(balance.support) else balance.below[np.newaxis]
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
    size = (right - left) / ACROSS

    def place(point: Array) -> tuple[float, float]:
        x = (left + right) / 2.0 + size * float((point - middle) @ ahead)
        y = (top + bottom + SMALL * brush.scale) / 2.0
        return x, y - size * float(point[1] - middle[1])

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
