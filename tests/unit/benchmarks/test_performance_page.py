"""The page of the benchmarks says beside each goal whether it is met."""

import json
import sys

import pytest

from tests.benchmarks import bench_graph
from tests.benchmarks.bench_graph import AGAINST, CASES, FACTORS, RAW, TWIN, report


def runs(twin):
    """Return one round in which every case but the twin is as fast as the plain loop."""
    return {name: [dict.fromkeys(FACTORS, twin if name == TWIN else 10.0)] for name in CASES}


def verdicts(text):
    lines = [line.strip('|').split('|') for line in text.splitlines() if '% |' in line]
    return {tuple(cell.strip() for cell in line[:3]): line[-1].strip() for line in lines}


@pytest.mark.parametrize(('twin', 'says'), [(8.5, 'met'), (8.4, '**missed**')])
def test_a_goal_is_met_if_the_median_reaches_it(twin, says):
    found = verdicts(report(runs(twin), {}, 0.0))
    assert len(found) == len(AGAINST)
    assert found[TWIN, RAW, 'wall'] == found[TWIN, RAW, 'computing'] == says


def test_the_page_is_written_again_from_its_data(tmp_path, monkeypatch, capsys):
    data, page = tmp_path / 'old.json', tmp_path / 'page.md'
    found = {'runs': runs(9.5), 'growth': {'gait': 0.25}, 'standing_s': 300.0}
    data.write_text(json.dumps(found))
    monkeypatch.setattr(sys, 'argv', ['bench', '--read', str(data), '--write', str(page)])
    bench_graph.main()
    assert page.read_text() == report(*found.values()) and 'gait +0.2' in page.read_text()
    assert json.loads(page.with_suffix('.json').read_text()) == found
    assert page.read_text() in capsys.readouterr().out
