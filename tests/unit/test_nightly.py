"""What is left to the night is there, and by day something else is left."""

from tests import ROOT
from tests.nightly import BY_NIGHT, is_by_night


def test_each_test_by_night_is_one_that_there_is():
    for each, instead in BY_NIGHT.items():
        path, _, name = each.partition('::')
        text = (ROOT / path).read_text(encoding='utf-8')
        assert f'def {name.partition("[")[0]}' in text, each
        assert instead, each


def test_others_are_for_the_day():
    assert is_by_night('tests/reliability/test_viewers.py::test_ten_viewers')
    assert not is_by_night('tests/graph/test_live.py::test_two_runs_do_not_meet')
    assert not is_by_night('tests/unit/test_nightly.py::test_others_are_for_the_day')
