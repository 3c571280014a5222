"""The colours of the charts can be told apart, also by the colour-blind."""

from itertools import combinations

import numpy as np
import pytest

from khr_view.charts.charts import BLUE, GREEN, ORANGE, PURPLE

# Of linear RGB, for no red, no green and no blue cones: Machado, Oliveira and Fernandes 2009.
MACHADO = {
    'normal': np.eye(3),
    'protanopia': [
        [0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]
    ],
    'deuteranopia': [
        [0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]
    ],
    'tritanopia': [
        [1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]
    ],
}  # fmt: skip
XYZ = np.array(
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
)  # of linear sRGB
WHITE = np.array([0.9505, 1.0, 1.089])
DISTINCT = 10.0  # CIE 1976 difference: two or so are seen side by side


def lab(color, matrix):
    """Return CIELAB of a colour as somebody sees it."""
    srgb = np.array([int(color[start : start + 2], 16) for start in (1, 3, 5)]) / 255.0
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    x, y, z = np.cbrt(XYZ @ np.clip(np.array(matrix) @ linear, 0.0, 1.0) / WHITE)
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


@pytest.mark.parametrize('sight', MACHADO)
def test_every_two_colors_are_distinct(sight):
    for one, other in combinations((BLUE, ORANGE, GREEN, PURPLE), 2):
        assert np.linalg.norm(lab(one, MACHADO[sight]) - lab(other, MACHADO[sight])) > DISTINCT
