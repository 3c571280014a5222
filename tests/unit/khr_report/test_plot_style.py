"""The look that all figures share."""

import pytest

from khr_report.plots.plot_style import LINE, balanced


@pytest.mark.parametrize('words', [3, 12, 13, 14, 20, 40])
def test_the_lines_of_a_title_are_few_and_about_equally_long(words):
    lines = balanced(' '.join(['figure'] * words)).splitlines()
    assert len(lines) == -(-words // ((LINE + 1) // len('figure ')))
    assert max(map(len, lines)) <= LINE
    assert max(map(len, lines)) - min(map(len, lines)) < len(lines) * len('figure ')
