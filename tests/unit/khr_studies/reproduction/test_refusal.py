"""No page is written of results that contradict one another."""

import pytest

from khr_common import RunError
from khr_studies.measuring.run_table import run_table
from khr_studies.measuring.thesis_values import STAGE_2
from khr_studies.reproduction import page, reproduce
from khr_studies.reproduction.experiment_plan import parse_plan
from khr_studies.reproduction.reproduce import Computed

STANDS = {'source': 'a row of the scoreboard', **STAGE_2.columns(7.6, 0), 'stayed_up': True}
FALLS = {**STANDS, 'source': 'a limit of the scoreboard', 'stayed_up': False}


@pytest.mark.parametrize('rows', [[STANDS], [STANDS, FALLS]])
def test_a_reproduction_whose_results_contradict_one_another_writes_nothing(
    rows, tmp_path, monkeypatch, capsys
):
    def compute(*_):
        return Computed(measured=run_table(rows))

    monkeypatch.setattr(reproduce, '_compute', compute)
    asked, out = parse_plan('3.8', fast=True), tmp_path / 'report'
    if len(rows) == 1:
        results = reproduce.reproduce(asked, out)
        assert page.write(results, out, out / 'findings.md').startswith(str(out / 'index.html'))
        assert (out / 'index.html').is_file()
        return
    with pytest.raises(RunError, match='no page is written'):
        reproduce.reproduce(asked, out)
    assert not [path for path in out.rglob('*') if path.is_file()]
    assert 'stand, K_A 12 at 7.6 deg, seed 0: stays up by a row' in capsys.readouterr().err
