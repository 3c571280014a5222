"""The run table: its types, its counts and intervals, its file, and measurement by a pool."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, t

from khr_common.errors import KhrError
from khr_studies.measuring.run_table import (
    half_interval,
    read_table,
    run_table,
    tally,
    wilson,
    write_table,
)


def row(gain, verdict, slip=0.01, vibration=0.1, **others):
    up = None if verdict is None else verdict != 'fell'
    return {
        'gain': gain,
        'verdict': verdict,
        'stayed_up': up,
        'largest_slip_m': slip,
        'vibration_rad_s': vibration,
        'fell_at_s': 4.0 if verdict == 'fell' else None,
        **others,
    }


def test_counts_and_medians_are_of_the_runs_that_stayed_up():
    rows = [row(18.0, 'fell', 9.0, 9.0), row(12.0, 'walked', 0.01), row(12.0, 'slipped', 0.03)]
    found = tally(run_table([*rows, row(12.0, 'fell', 9.0), row(12.0, None)]), ['gain'])
    assert found['gain'].tolist() == [18.0, 12.0], 'in the order of the rows'
    assert found[['runs', 'up', 'lost', 'slipped']].to_numpy().tolist() == [
        [1, 0, 1, 0],
        [3, 2, 1, 1],
    ]
    lost, mixed = found.to_dict('records')
    assert mixed['largest_slip_m'] == pytest.approx(0.02) and mixed['fell_at_s'] == 4.0
    assert np.isnan(lost['vibration_rad_s'])


@given(st.integers(1, 300), st.data())
def test_interval_of_a_share_is_wilson_s(runs, data):
    hits = data.draw(st.integers(0, runs))
    expected = binomtest(hits, runs).proportion_ci(method='wilson')
    assert wilson(hits, runs) == pytest.approx((expected.low, expected.high), abs=1e-12)
    assert wilson(0, 0) == (0.0, 1.0), 'no runs leave it open'


@given(st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=9).filter(lambda x: np.ptp(x) > 1e-3))
def test_interval_of_a_mean_is_students(values):
    low, high = t.interval(0.95, len(values) - 1, np.mean(values), np.std(values, ddof=1))
    assert half_interval(values) == pytest.approx((high - low) / 2.0 / np.sqrt(len(values)))


def test_a_table_is_the_same_after_its_file(tmp_path):
    rows = [row(0.1 + 0.2, 'walked', seed=0), row(12.0, 'fell', seed=1), row(12.0, None, seed=2)]
    table = run_table(rows)
    write_table(table, tmp_path / 'new' / 'runs.csv')
    found = read_table(tmp_path / 'new' / 'runs.csv')
    pd.testing.assert_frame_equal(found, table, check_exact=True)


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        (None, 'No such file'),
        ('', 'No columns'),
        ('a\n1\n', "no column 'seed'"),
        ('a,seed\n1,x\n', 'x'),
    ],
)
def test_a_file_that_holds_no_such_table_is_refused_in_one_line(tmp_path, text, reason):
    path = tmp_path / 'runs.csv'
    if text is not None:
        path.write_text(text)
    with pytest.raises(KhrError, match=rf'runs\.csv: not a table of runs \(.*{reason}.*accepted'):
        read_table(path, ['seed'])
