"""Every entry of tests/nightly.py is a test that exists."""

from tests import ROOT
from tests.nightly import BY_NIGHT


def test_each_test_by_night_is_one_that_there_is():
    for each, instead in BY_NIGHT.items():
        path, _, name = each.partition('::')
        text = (ROOT / path).read_text(encoding='utf-8')
        assert f'def {name.partition("[")[0]}' in text, each
        assert instead, each
