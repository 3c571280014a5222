"""A sweep that bisects runs along the limit, finds it, and never runs for ever."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common import KhrError
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
LARGEST = 4  # runs of a line: 2**4 - 1 values


def line_of(trial):
    return trial.point[GAIN], trial.seed


@given(st.lists(st.floats(-1.0, 8.0), min_size=4, max_size=4))
def test_each_line_is_bisected_to_its_limit(limits):
    limit = dict(
        zip([(gain, seed) for gain in (6.0, 12.0) for seed in (0, 1)], limits, strict=True)
    )
    finished, stayed, lost = {}, {}, {}
    while due := list(SWEEP.due('v', finished)):
        assert SWEEP.count_missing('v', finished) >= len(due)
        assert len({line_of(trial) for trial in due}) == len(due)
        for trial in due:
            here = trial.point[INCLINATION]
            up = finished[trial.id] = here <= limit[line_of(trial)]
            (stayed if up else lost).setdefault(line_of(trial), []).append(here)
    assert SWEEP.count_missing('v', finished) == 0
    assert len(finished) <= LARGEST * len(limit)
    for line, edge in limit.items():
        assert max(stayed.get(line, [VALUES[0]])) == max(
            [value for value in VALUES if value <= edge], default=VALUES[0]
        )
        assert min(lost.get(line, [VALUES[-1]])) == min(
            [value for value in VALUES if value > edge], default=VALUES[-1]
        )


def test_without_a_bisection_all_is_due_at_once():
    whole = parse_sweep(TEXT.replace('bisect: simulator.inclination_deg\n', ''), 'mine.yaml')
    every = list(whole.trials('v'))
    assert [trial.id for trial in whole.due('v', {})] == [trial.id for trial in every]
    assert whole.count_missing('v', {every[0].id: False}) == len(every) - 1


def results(trial):
    """Return the row of an invented run: it is lost beyond 3 deg, with gain 12 beyond 5."""
    limit = 3.0 if trial.point[GAIN] == 6.0 else 5.0
    up = trial.point[INCLINATION] <= limit
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


def sweep_into(folder):
    request = {'version': 'v', **SWEEP.record()}
    with Folder(folder, request) as open_folder:
        return [row for batch in sweep.run_missing(None, [(SWEEP, open_folder)]) for row in batch]


@pytest.mark.slow
def test_rounds_go_on_until_every_limit_is_found_and_resume(computed, tmp_path):
    done, _ = computed
    rows = sweep_into(tmp_path / 'sweep')
    assert len(rows) == len(done) == LARGEST * 4
    table = read_results(tmp_path / 'sweep').to_pylist()
    for gain, limit in ((6.0, 3.0), (12.0, 5.0)):
        some = [row for row in table if row[GAIN] == gain]
        assert max(row[INCLINATION] for row in some if row['stayed_up']) == limit
        assert min(row[INCLINATION] for row in some if not row['stayed_up']) == limit + 0.5
    assert sweep_into(tmp_path / 'sweep') == []


def test_a_run_whose_workers_die_ends_its_line_and_is_tried_by_the_next_command(
    computed, tmp_path
):
    _, lost = computed
    lost.add(VALUES[len(VALUES) // 2])
    assert sweep_into(tmp_path / 'sweep') == [None] * 4
    lost.clear()
    assert len(sweep_into(tmp_path / 'sweep')) == LARGEST * 4


def test_only_an_axis_of_numbers_is_bisected():
    text = TEXT.replace('bisect: simulator.inclination_deg', 'bisect: gait.cycles')
    with pytest.raises(KhrError, match=r"mine\.yaml: bisect: 'gait.cycles'.*an axis of numbers"):
        parse_sweep(text, 'mine.yaml')
