"""A sweep that bisects runs along the limit, finds it, and never runs for ever."""

from contextlib import ExitStack

import pytest

from khr_bringup.code_version import code_version
from khr_sweeps import sweep
from khr_sweeps.reading import parse_sweep
from khr_sweeps.results.folder import Folder, read_results
from khr_sweeps.trial import RESULTS

INCLINATION, GAIN = 'simulator.inclination_deg', 'ankle_controller.gain'
TEXT = """scenario: walk_3deg
set: {simulator.initial_tilt_deg: 0.3}
seeds: 2
bisect: simulator.inclination_deg
grid:
  simulator.inclination_deg: {start: 0.0, stop: 7.0, step: 0.5}
  ankle_controller.gain: [6.0, 12.0]
"""
SWEEP = parse_sweep(TEXT, 'mine.yaml')
VALUES = SWEEP.axes[INCLINATION].values
GRID = parse_sweep(
    TEXT.replace('bisect: simulator.inclination_deg\n', '').replace(
        '{start: 0.0, stop: 7.0, step: 0.5}', '[1.5, 5.5]'
    ),
    'grid.yaml',
)
LARGEST = 4  # runs of a line: 2**4 - 1 values

LIMITS = {(6.0, 0): -1.0, (6.0, 1): 3.0, (12.0, 0): 5.2, (12.0, 1): 8.0}  # by gain and seed, deg


def results(trial):
    """Return the row of an invented run, which is lost beyond the limit of its line."""
    up = trial.point[INCLINATION] <= LIMITS[trial.point[GAIN], trial.seed]
    return {**dict.fromkeys(RESULTS), 'verdict': 'slipped', 'stayed_up': up}


@pytest.fixture
def computed(monkeypatch):
    """Compute invented runs in this process; return what was run, and which runs to lose."""
    done, lost = [], set()

    def compute(pool, function, tasks):
        for run, trial in tasks:
            done.append(trial)
            bad = trial.point[INCLINATION] in lost
            yield [(run, None if bad else (results(trial), None))]

    monkeypatch.setattr(sweep, 'compute', compute)
    return done, lost


def sweep_into(folder, *others):
    """Compute the bisection into a folder, and beside it other sweeps into those of their names."""
    with ExitStack() as stack:
        plan = [
            (each, stack.enter_context(Folder(path, {'version': 'v', **each.record()})))
            for each, path in [
                (SWEEP, folder),
                *((one, folder.with_name(one.name)) for one in others),
            ]
        ]
        rows = [row for batch in sweep.run_missing(None, plan) for row in batch]
        for each, inside in plan:
            assert None in rows or not each.count_missing(code_version(), inside.finished())
        return rows


def test_rounds_go_on_until_every_limit_is_found_and_resume(computed, tmp_path):
    done, _ = computed
    rows = sweep_into(tmp_path / 'sweep')
    assert len(rows) == len(done) == LARGEST * 4
    table = read_results(tmp_path / 'sweep').to_pylist()
    for (gain, seed), limit in LIMITS.items():
        line = [row for row in table if (row[GAIN], row['seed']) == (gain, seed)]
        stayed = [row[INCLINATION] for row in line if row['stayed_up']]
        lost = [row[INCLINATION] for row in line if not row['stayed_up']]
        assert max(stayed, default=None) == max([x for x in VALUES if x <= limit], default=None)
        assert min(lost, default=None) == min([x for x in VALUES if x > limit], default=None)
    assert sweep_into(tmp_path / 'sweep') == []


@pytest.mark.usefixtures('computed')
def test_runs_that_another_sweep_shares_do_not_end_a_line(tmp_path):
    rows = sweep_into(tmp_path / 'sweep', GRID)
    assert len(rows) == LARGEST * 4 + GRID.count
    assert sweep_into(tmp_path / 'sweep') == []


def test_a_run_whose_workers_die_ends_its_line_and_is_tried_by_the_next_command(
    computed, tmp_path
):
    _, lost = computed
    lost.add(VALUES[len(VALUES) // 2])
    assert sweep_into(tmp_path / 'sweep') == [None] * 4
    lost.clear()
    assert len(sweep_into(tmp_path / 'sweep')) == LARGEST * 4
