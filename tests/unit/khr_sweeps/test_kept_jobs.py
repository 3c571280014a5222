"""Jobs whose results are kept: none is computed twice, and none is taken for another."""

import sys

import pytest

from khr_studies.measuring.condition import Condition
from khr_sweeps.pool import local_pool
from khr_sweeps.progress import ProgressBar
from khr_sweeps.results.kept_jobs import KeptJobs
from khr_sweeps.results.store import Store
from khr_sweeps.trial import Row, identity
from tests.fakes.jobs import HerePool


def square(number: float, condition: Condition | None = None) -> float:
    print('on the way', file=sys.stderr)
    return number * number


def cube(number: float) -> float:
    return number**3


def jobs(pool, folder, version='v'):
    return KeptJobs(pool, folder, version, ProgressBar('jobs', 0), {square: 3})


def submit(kept, function, *arguments):
    """Return the result of one job after what is kept is closed."""
    with kept:
        return kept.submit(function, *arguments).result()


def test_a_job_is_computed_once_over_all_commands(tmp_path, capsys):
    pool = HerePool()
    for _ in range(2):
        with jobs(pool, tmp_path / 'jobs') as some:
            assert [some.submit(square, n).result() for n in (2, 3)] == [4, 9]
    assert pool.count == 2
    assert capsys.readouterr().err == ''


@pytest.mark.parametrize(
    ('other', 'version'),
    [
        ((square, 3), 'v'),
        ((cube, 2), 'v'),
        ((square, 2, Condition(ankle_gain=12.0)), 'v'),
        ((square, 2.0), 'v'),
        ((square, 2), 'w'),
    ],
)
def test_another_job_is_not_taken_for_it(tmp_path, other, version):
    pool = HerePool()
    submit(jobs(pool, tmp_path), square, 2)
    submit(jobs(pool, tmp_path, version), *other)
    assert pool.count == 2


def test_a_pool_of_processes_will_do(tmp_path):
    with local_pool(1) as pool:
        assert submit(jobs(pool, tmp_path), identity, 3.5, 'v') == identity(3.5, 'v')
    assert submit(jobs(None, tmp_path), identity, 3.5, 'v') == identity(3.5, 'v')


def test_results_keep_their_types(tmp_path):
    row = {'verdict': 'fell', 'stayed_up': False, 'seed': 1, 'slip': 0.1, 'toe_n': None}

    def measure(kind: str) -> list[Row]:
        return [row]

    assert submit(jobs(HerePool(), tmp_path), measure, 'lift') == [row]
    (again,) = submit(jobs(None, tmp_path), measure, 'lift')
    assert again == row
    assert list(map(type, again.values())) == list(map(type, row.values()))


@pytest.mark.parametrize('value', [{'items': 1}, None, 'x'])
def test_a_result_of_another_type_is_computed_again(tmp_path, value):
    submit(jobs(HerePool(), tmp_path), square, 2)
    (file,) = tmp_path.iterdir()
    with Store(file, {'results': 'jobs'}, lambda data: data) as store:
        store.add(dict.fromkeys(store.values, value))
    pool = HerePool()
    for _ in range(2):
        assert submit(jobs(pool, tmp_path), square, 2) == 4
    assert pool.count == 1
