"""Jobs whose results are kept: none is computed twice, and none is taken for another."""

import math
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import pytest

from khr_experiments.condition import Condition
from khr_experiments.job_cache import KeptJobs
from khr_experiments.json_file import known
from khr_experiments.scoreboard_runs import MeasuredLift
from khr_sweeps.progress import Bar
from tests.fakes.benches import outcome


def square(number: float, condition: Condition | None = None) -> float:
    print('on the way', file=sys.stderr)
    return number * number


def cube(number: float) -> float:
    return number**3


class Here:
    """A pool that computes at once, and counts."""

    def __init__(self):
        self.count = 0

    def submit(self, function, *arguments):
        self.count += 1
        return Done(function(*arguments))


class Done:
    def __init__(self, value):
        self.result = lambda: value

    def add_done_callback(self, function):
        function(self)


def jobs(pool, folder, version='v'):
    return KeptJobs(pool, folder, version, Bar('jobs', 0), {square: 3})


def test_a_job_is_computed_once_over_all_commands(tmp_path, capsys):
    pool = Here()
    for _ in range(2):
        some = jobs(pool, tmp_path / 'jobs')
        assert [some.submit(square, n).result() for n in (2, 3)] == [4, 9]
    assert pool.count == 2
    assert capsys.readouterr().err == ''


@pytest.mark.parametrize(
    'other',
    [
        (square, 3),
        (cube, 2),
        (square, 2, Condition()),
        (square, 2, Condition(ankle_gain=12.0)),
        (square, 2.0),
    ],
)
def test_another_job_is_not_taken_for_it(tmp_path, other):
    pool = Here()
    some = jobs(pool, tmp_path)
    some.submit(square, 2)
    some.submit(*other)
    assert pool.count == 2


def test_another_version_is_computed_anew(tmp_path):
    pool = Here()
    for version in 'vw':
        jobs(pool, tmp_path, version).submit(square, 2)
    assert pool.count == 2


def test_a_torn_result_is_computed_anew(tmp_path):
    pool = Here()
    some = jobs(pool, tmp_path)
    some.submit(square, 2)
    (file,) = tmp_path.iterdir()
    for length in range(len(file.read_bytes())):
        file.write_bytes(file.read_bytes()[:length])
        assert some.submit(square, 2).result() == 4
        assert pool.count == length + 2


def test_a_pool_of_processes_will_do(tmp_path):
    with ProcessPoolExecutor(1, mp_context=get_context('spawn')) as pool:
        assert jobs(pool, tmp_path).submit(known, 3.5).result() == 3.5
    assert jobs(None, tmp_path).submit(known, 3.5).result() == 3.5


def test_results_keep_their_types(tmp_path):
    """So do those of a robot that fell, whose forces are not known."""
    fallen = MeasuredLift(outcome('fell'), math.nan, math.nan, 0.1)

    def measure(kind: str) -> tuple[float, list[MeasuredLift]]:
        return 0.1, [fallen]

    first, again = (jobs(Here(), tmp_path).submit(measure, 'lift').result() for _ in range(2))
    assert repr(again) == repr(first)
    assert type(again[1][0]) is MeasuredLift and again[1][0].outcome == fallen.outcome


@pytest.mark.parametrize('text', ['[{"items": 1}]', '[null]', '[1, 2]', '{}', '["x"]'])
def test_a_file_that_holds_no_such_result_is_computed_anew(tmp_path, text):
    pool = Here()
    jobs(pool, tmp_path).submit(square, 2)
    next(tmp_path.iterdir()).write_text(text)
    assert jobs(pool, tmp_path).submit(square, 2).result() == 4
    assert pool.count == 2
