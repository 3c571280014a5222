"""Whole studies: the reproduction in its quick form, a calibration, half the physics step."""

import csv
import math
import shutil
import subprocess
from dataclasses import replace

import pytest

from khr_common import KhrError
from khr_studies.calibration.search import CANDIDATE, Journal
from khr_studies.engines.study import ENGINES, STEPS, STUDIED, with_engine
from khr_studies.measuring.bench import Bench
from khr_studies.measuring.ensemble_file import read_ensemble
from khr_studies.measuring.json_file import read_json
from khr_studies.measuring.thesis_values import LIMITS
from khr_studies.measuring.thesis_walks import TRENDS, WALKS
from khr_studies.reproduction.experiment_plan import MAP, SCOREBOARD, parse_plan
from khr_studies.reproduction.findings import Findings
from khr_studies.reproduction.findings_page import findings_markdown
from khr_studies.reproduction.reproduce import Computed, reproduce
from khr_studies.scoreboard.page import scoreboard_markdown
from khr_studies.scoreboard.rows import Scoreboard
from khr_studies.thesis_figures.registry import FIGURES, paths
from khr_sweeps.pool import local_pool
from khr_sweeps.results.store import read_store
from tests.support.runs import KHR

ENGINE = 'mujoco'  # the quicker one
PATIENCE = 900.0  # s, on a machine that does other work as well
pytestmark = [pytest.mark.slow, pytest.mark.timeout(PATIENCE)]


@pytest.fixture(scope='module')
def place(tmp_path_factory):
    return tmp_path_factory.mktemp('reproduction')


@pytest.fixture(scope='module')
def done(place):
    """Reproduce everything in the quick form."""
    return subprocess.run(
        [*KHR, 'reproduce', '--fast', '--engine', ENGINE],
        cwd=place,
        text=True,
        capture_output=True,
        timeout=PATIENCE,
        check=False,
    )


def rows(path):
    with path.open(encoding='utf-8') as file:
        return list(csv.DictReader(file))


@pytest.mark.nightly
def test_every_figure_and_map_is_a_picture_with_its_numbers(done, place):
    assert done.returncode == 0, done.stderr
    maps = parse_plan(None, True).maps
    total = len(FIGURES) + len(maps)
    assert f'{total} of {total} figures' in done.stdout
    assert done.stdout.startswith('report/index.html: ') and done.stdout.count('\n') == 1
    assert 'fitted rows' in done.stdout
    assert 'Traceback' not in done.stderr
    figures = place / 'report' / 'figures'
    for number in FIGURES:
        image, table = paths(number, figures, ENGINE)
        assert image.stat().st_size > 10_000, number
        content = rows(table)
        assert len(content) > 1, number  # the quick form may have one walk and its median
        assert all(math.isfinite(float(row['x'])) and row['curve'] for row in content), number
        assert any(math.isfinite(float(row['y'])) for row in content), number
    assert maps
    for name in maps:
        assert name.startswith(MAP)
        assert (figures / f'{name}.png').stat().st_size > 10_000
        assert sum(int(row['runs']) for row in rows(figures / f'{name}.csv')) > 0


@pytest.mark.nightly
def test_the_page_and_the_findings_hold_every_figure_and_row(done, place):
    report = place / 'report'
    board = read_json(report / 'scoreboard.json', Scoreboard)
    assert any(row['verdict'] == 'passed' for row in board.rows)
    assert len(board.walks) == len(WALKS) and len(board.trends) == len(TRENDS)
    assert [(row['condition'], row['thesis_deg']) for row in board.limits[:-1]] == [
        (row.condition.title, row.thesis_deg) for row in LIMITS
    ]
    assert (report / 'scoreboard.md').read_text(encoding='utf-8') == scoreboard_markdown(board)
    page = (report / 'index.html').read_text(encoding='utf-8')
    assert page.count('data:image/png') >= len(FIGURES)
    for number in FIGURES:
        assert f'khr figure {number}' in page
    findings = read_json(report / 'findings.json', Findings)
    assert (report / 'findings.md').read_text() == findings_markdown(findings)
    assert findings.scoreboard == board
    assert set(findings.maps) == set(parse_plan(None, True).maps)
    assert findings.soles and findings.friction and findings.tilting and findings.peaks


@pytest.mark.parametrize('only', ['5.81', '', '3.8,,4.5', 'scoreboards'])
def test_an_unknown_number_is_one_line(only):
    with pytest.raises(KhrError, match=r'--only: .* is not known; accepted: .*3\.8.*map_.*'):
        parse_plan(only, fast=True)


def test_what_is_wanted_is_what_is_named():
    some = parse_plan('5.5, 3.4,scoreboard', fast=False)
    assert (some.figures, some.maps, some.scoreboard) == (('3.4', '5.5'), (), True)
    assert set(some.experiments) == {*FIGURES['3.4'].experiments, *FIGURES['5.5'].experiments}
    every = parse_plan(None, fast=False)
    assert every.scoreboard and every.figures == tuple(FIGURES)
    assert SCOREBOARD not in every.experiments


def test_an_evaluation_that_fails_does_not_lose_the_page():
    computed = Computed()
    assert computed.attempt('lines', lambda: 1 / 0) is None
    assert computed.failed == ['lines: ZeroDivisionError: division by zero']
    assert computed.attempt('lines', lambda: 'well') == 'well'


def test_a_place_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(KhrError, match=r'--out: .*file'):
        reproduce(parse_plan('3.8', fast=True), tmp_path / 'file' / 'report')


PLAN = """
settings:
  gait.hold_time: 0.2
  gait.end_pause: 0.0
constants:
  pads: {parameters: [simulator.pad_distance], range: [0.02, 0.027], source: a test}
limits:
  - {motion: leg_lift, thesis_deg: 6.4, tolerance_deg: 5.0}
"""


@pytest.mark.nightly
def test_command_searches_goes_on_and_writes_all_files(tmp_path):
    (tmp_path / 'plan.yaml').write_text(PLAN)

    def calibrate(journal):
        return subprocess.run(
            [
                *(*KHR, 'calibrate', '--config', 'plan.yaml', '--journal', journal),
                *('--out', 'page.md', '--members', 'members.json', '--confirm', '0'),
                *('--candidates', '4', '--population', '4', '--seeds', '1', '--workers', '2'),
            ],
            cwd=tmp_path,
            capture_output=True,
            text=True,
        )

    first = calibrate('journal')
    assert first.returncode == 0, first.stderr
    assert 'of 16 candidates' in first.stdout
    head, robots = read_store(tmp_path / 'journal', CANDIDATE.validate_python)
    assert head['engine'] == 'mujoco' and len(robots) == 16
    low, *_, high = sorted(robots, key=lambda robot: robot.constants['pads'])
    assert low.value('stand, no control') < high.value('stand, no control')
    members = read_ensemble(tmp_path / 'members.json')
    assert members[0].constants['simulator.pad_distance'] in {
        robot.constants['pads'] for robot in robots
    }
    with Journal(tmp_path / 'interrupted', head) as journal:
        for robot in robots[:-2]:
            journal.add(robot)
    again = calibrate('interrupted')
    assert again.stdout == first.stdout
    found = read_store(tmp_path / 'interrupted', CANDIDATE.validate_python)[1]
    assert sorted(found, key=str) == sorted(robots, key=str)
    shutil.copy(tmp_path / 'plan.yaml', tmp_path / 'other')
    refused = calibrate('other')
    assert refused.returncode == 2 and 'not a journal' in refused.stderr


@pytest.mark.nightly
@pytest.mark.parametrize('engine', ENGINES)
def test_half_the_step_moves_no_limit(engine):
    """Single seeds move by what their last bisections scatter; the mean of some stays."""
    with local_pool(2) as pool:
        bench = Bench(pool, seeds=3, tolerance=0.1)
        coarse, fine = (
            bench.limit(replace(STUDIED, changes=with_engine(engine, changes)))
            for changes in ((), STEPS['step 0.5 ms'])
        )
    assert fine.mean == pytest.approx(coarse.mean, abs=0.2)  # deg
    assert 6.0 < coarse.mean < 10.0  # a search that found nothing would agree as well
