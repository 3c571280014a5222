"""The generated documents are up to date, and stored results are rendered beside their data."""

import numpy as np

from khr_studies.calibration.ensemble import missed_rows
from khr_studies.calibration.study import Calibration
from khr_studies.documents.docs_generator import generated
from khr_studies.measuring.ensemble_file import read_ensemble, spread_of
from khr_studies.measuring.json_file import read_json
from khr_studies.measuring.thesis_values import EMPTY_FOOT_MOST
from khr_studies.scoreboard.page import summary
from khr_studies.scoreboard.rows import Scoreboard
from tests import ROOT


def test_the_documents_are_what_make_docs_writes():
    documents = generated(ROOT)
    assert len(documents) > 5
    for path, text in documents.items():
        assert path.read_text(encoding='utf-8') == text, f'{path.name}: run: make docs'


def test_index_names_every_document():
    index = (ROOT / 'docs' / 'index.md').read_text(encoding='utf-8')
    for path in (ROOT / 'docs').glob('*.md'):
        assert path.name == 'index.md' or f']({path.name})' in index, path.name


def read_readme():
    """Return the README as one line."""
    return ' '.join((ROOT / 'README.md').read_text(encoding='utf-8').split())


def read_scoreboard():
    """Return the scoreboard of the default robot."""
    return read_json(ROOT / 'docs' / 'scoreboard.json', Scoreboard)


def test_the_readme_has_the_limits_of_the_scoreboard():
    board, readme = read_scoreboard(), read_readme()
    limit = {row['condition']: row['deg'] for row in board.limits}
    others = spread_of(read_ensemble()[1:])
    for row in board.limits:
        if row['condition'] != 'inverted pendulum':
            of_engines = row['other_engine_deg'] - row['deg']
            half_width = np.hypot(row['seeds_deg'], of_engines)
            numbers = f'{row["thesis_deg"]:g} | {row["deg"]:.1f} | {half_width:.1f}'
            spread = ' to '.join(f'{each:.1f}' for each in others.get(row['condition'], ()))
            cells = [row['condition'], numbers, spread, row['verdict']]
            assert f'| {" | ".join(cells)} |'.replace('|  |', '| |') in readme
            assert (row['lifted_load'] or 0.0) < EMPTY_FOOT_MOST, 'it tips on one leg'
    verdicts = [row['verdict'] for row in board.limits if row['kind'] != 'formula']
    assert verdicts.count('missed') == 2 and 'passed' not in verdicts
    standing, walking = (
        limit[f'{motion}, K_A 12'] - limit[f'{motion}, no control'] for motion in ('stand', 'walk')
    )
    assert f'limit of standing by {standing:.1f} deg, in the thesis by 1.2' in readme
    assert f'that of walking by {walking:.1f}, in the thesis by 3.3' in readme
    assert f'it walks up to {limit["walk, no control"]:.1f} deg (thesis: 5.55)' in readme
    assert f'both loops ends at {limit["stand, K_A 12, K_H 13"]:.1f} deg' in readme
    for motion in ('walk', 'stand'):
        assert limit[f'{motion}, K_A 12, K_H 13'] - limit[f'{motion}, K_A 12'] < 0.2
    robots = len(read_ensemble())
    assert f'{robots - 1} other robots, the rest of an ensemble of {robots},' in readme
    walks = [row['slipped'] for row in board.limits if row['condition'].startswith('walk')]
    assert set(walks) == {1.0}, 'just below their limits all walks slip'
    predictions, fitted, *_ = summary(board).split('; ')
    assert f'{predictions}; {fitted}:' in readme


def verdicts_of(rows, column, words):
    """Return the verdicts of the rows with these words in a column."""
    return {row['verdict'] for row in rows if words in row[column]}


def test_the_readme_has_the_mechanism_of_the_scoreboard():
    board, readme = read_scoreboard(), read_readme()
    trends = {row['name'].partition(':')[0]: np.degrees(row['values']) for row in board.trends}
    none, ka12, ka18 = trends['feedback raises vibration']
    assert (
        f'from {none:.1f} deg/s without control to {ka12:.1f} with K_A 12 and {ka18:.1f}' in readme
    )
    for direction in (
        'feedback raises vibration',
        'two motors vibrate more than one',
        'the amplitude of the rate grows with phi, no control',
        'rubber lowers vibration',
    ):
        assert verdicts_of(board.trends, 'name', direction) == {'passed'}, direction
    on_rubber, smooth = (
        trends['rubber lowers vibration'][0],
        trends['vibration grows much with K_A'][0],
    )
    assert on_rubber > 0.95 * smooth, 'with equal gain rubber does not calm the walk'
    (extra,) = [row['values'] for row in board.trends if row['name'].startswith('the extra peak')]
    assert f'ankle loop lies at {extra[-1]:.2f} Hz with K_A 18' in readme
    with_hip = trends['rubber reduces vibration drastically']
    assert with_hip[0] < with_hip[1] < 2.0 * with_hip[0]
    assert verdicts_of(board.walks, 'thesis', 'single dominant peak') == {'passed'}
    assert verdicts_of(board.walks, 'thesis', 'walks by the force sensors') == {'passed'}
    assert verdicts_of(board.walks, 'thesis', 'f_0 is twice f_n') == {'missed'}


def test_the_chosen_robot_meets_every_ratio_and_line_on_both_engines():
    calibration = read_json(ROOT / 'docs' / 'calibration.json', Calibration)
    plan, robot, stiff = calibration.plan, calibration.best, calibration.shipped['stiff']
    assert len(robot.engines) == 2 and stiff.constants == plan.constants_of_robot('stiff')
    wanted = {row.title: row.ratio for row in plan.ratios} | {row.title: 1.0 for row in plan.lines}
    for title, least in wanted.items():
        for engine in robot.engines:
            assert robot.value(title, engine) >= least, (title, engine)
    readme = read_readme()
    gain, frequency = (
        robot.value(f'ankle loop, {quantity}', 'bullet')
        for quantity in ('critical gain', 'frequency at the critical gain')
    )
    assert f'unstable at K_A {gain:.1f} and {frequency:.1f} Hz' in readme
    gain = robot.value('hip loop, critical gain', 'bullet')
    assert f'The hip loop becomes unstable at K_H {gain:.1f}' in readme
    others = [len(missed_rows(plan, each)) for each in calibration.found.robots[1:]]
    more, fewer = (len(missed_rows(plan, each)) for each in (stiff, robot))
    missed = f'{min(others)} to {max(others)} rows of the calibration, the default robot {fewer}'
    assert f'they miss {missed}' in readme
    assert more > fewer
    words = f'misses {more} rows of the calibration where the default robot misses {fewer}'
    assert words in readme
