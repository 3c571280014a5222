"""Viewers that come and go, in the short form of what ``make chaos`` does for ten minutes."""

import pytest

from tests.reliability.harms.viewers import trouble


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_ten_viewers_each_come_and_go_beside_busy_loops(tmp_path):
    faults, _ = trouble(tmp_path, 20.0)
    assert not faults
