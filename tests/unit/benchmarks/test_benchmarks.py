"""The page of the benchmarks, and the loop that the twin is compared with."""

import json

import pytest

from tests.benchmarks import graphs
from tests.benchmarks.__main__ import DATA, PAGE
from tests.benchmarks.clock import WALL
from tests.benchmarks.page import page


def test_the_page_is_that_of_its_data():
    assert page(json.loads(DATA.read_text(encoding='utf-8'))) == PAGE.read_text(encoding='utf-8')


@pytest.mark.nightly
def test_the_plain_loop_moves_as_the_twin():
    """It compares the final joint angles itself."""
    assert graphs.plain()[WALL] > 0.0
