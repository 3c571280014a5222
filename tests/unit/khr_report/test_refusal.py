"""No page is written of results that contradict one another."""

from dataclasses import replace

import pytest

from khr_common import RunError
from khr_experiments.consistency import Said
from khr_experiments.published import STAGE_2
from khr_report import reproduce
from khr_report.reproduce import Computed

STANDS = Said('a row of the scoreboard', STAGE_2, 7.6, 0, True)
FALLS = replace(STANDS, source='a limit of the scoreboard', survived=False)


@pytest.mark.parametrize('said', [[STANDS], [STANDS, FALLS]])
def test_a_reproduction_whose_results_contradict_one_another_writes_nothing(
    said, tmp_path, monkeypatch, capsys
):
    def compute(*_):
        return Computed([], None, {}, (), 0, [], said)

    monkeypatch.setattr(reproduce, '_compute', compute)
    if len(said) == 1:
        assert reproduce.reproduce(tmp_path / 'report', '3.8', fast=True) == 0
        assert (tmp_path / 'report' / 'index.html').is_file()
        return
    with pytest.raises(RunError, match='no page is written'):
        reproduce.reproduce(tmp_path / 'report', '3.8', fast=True)
    assert not [path for path in (tmp_path / 'report').rglob('*') if path.is_file()]
    assert 'stand, K_A 12 at 7.6 deg, seed 0: stays up by a row' in capsys.readouterr().err
