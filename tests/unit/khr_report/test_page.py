"""Pages hold all that was found, stand alone, and say what the numbers say."""

import base64
import re
from itertools import count
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from khr_bringup.scenario import load
from khr_experiments import scoreboard
from khr_experiments.critical import Limit
from khr_experiments.experiments import Run
from khr_experiments.published import LIMITS, TRENDS, walking
from khr_report.page.board import counts, judged
from khr_report.page.findings import findings
from khr_report.page.html import markdown, tables
from khr_report.page.index import write_index
from khr_report.page.text import duration
from khr_report.page.trials import added
from khr_report.reproduction import FigureResult, Reproduction
from tests.fakes.benches import Opposite, Thesis
from tests.support.pages import check_alone

HASH = '0123456789abcdef' * 4


def figure(folder, number, experiments=(), error=''):
    folder.mkdir(parents=True, exist_ok=True)
    image, table = folder / f'{number}.png', folder / f'{number}.csv'
    if not error:
        picture = Figure(figsize=(1.0, 1.0))
        picture.text(0.1, 0.5, number)
        picture.savefig(image)
        table.write_text(f'panel,{number}\n')
    return FigureResult(
        number,
        f'The picture of {number}',
        image,
        table,
        f'khr figure {number}',
        experiments,
        1.0,
        error,
    )


TIMES = count(1.0, 0.125)  # no two runs take as long


def run(name, seed, verdict='walked', slip=0.01, **changes):
    scenario = load(name).changed(
        {tuple(key.split('__')): value for key, value in changes.items()}
    )
    row = {
        'verdict': verdict,
        'fell_at_s': 4.25 if verdict == 'fell' else None,
        'time_s': 13.6,
        'largest_slip_m': slip,
        'vibration_rad_s': 0.1,
        'trajectory_hash': f'{HASH}{seed}',
        'wall_time_s': next(TIMES),
        'error': None,
    }
    return Run({'scenario': name, **changes}, seed, row, scenario, Path('absent'))


def reproduction(folder, bench=None, runs=None, **changes):
    board, summary = scoreboard.board(bench or Thesis())
    contents = {
        'figures': [
            figure(folder / 'figures', '3.8'),
            figure(folder / 'elsewhere', '5.9', ('a',)),
            figure(folder, 'friction'),
            figure(folder, '4.4', error='the <circuit> does not converge'),
        ],
        'scoreboard': board,
        'scoreboard_summary': summary,
        'maps': [figure(folder / 'figures', 'map_a')],
        'runs': runs
        if runs is not None
        else {'a': [run('walk_3deg', 0), run('walk_3deg', 1, 'fell')]},
        'seeds': {'a': 2},
        'seconds': 754.0,
        'fast': False,
        'versions': {'code': 'abcdef', 'numpy': '2.0'},
        'command': 'khr reproduce',
        'lines': '# Lines\n\nThe gait makes most of them.\n\n## Peaks\n\n| a |\n|---|\n| b |',
        'tables': {'map_a': '| best gain |\n| --- |\n| fifteen |\n'},
    }
    return Reproduction(**(contents | changes))


# ---- the page of a reproduction ----


def test_page_holds_every_figure_row_and_run_and_stands_alone(tmp_path):
    contents = reproduction(tmp_path)
    path = write_index(tmp_path, contents)
    assert path == tmp_path / 'index.html'
    page = check_alone(path)
    assert 'fifteen' in page.text
    for each in (*contents.figures, *contents.maps):
        assert each.title in page.text
        if each.error:
            assert each.error in page.text
        else:
            assert (
                f'data:image/png;base64,{base64.b64encode(each.image.read_bytes()).decode()}'
                in page.sources
            )
            assert each.command in page.text
    assert 'figures/3.8.csv' in page.links
    for section, rows in tables(contents.scoreboard):
        assert section in page.text
        for row in rows:
            assert all(cell in page.text for cell in row.values())
    for some in contents.runs.values():
        assert all(each.row['trajectory_hash'] in page.text for each in some)
    for word in (
        'fell at 4.25 s',
        '13 min',
        'abcdef',
        contents.scoreboard_summary,
        contents.command,
        'The gait makes most of them.',
    ):
        assert word in page.text


def test_table_outside_the_page_s_folder_is_taken_in(tmp_path):
    contents = reproduction(tmp_path / 'made')
    page = check_alone(write_index(tmp_path / 'report', contents))
    tables_within = [link for link in page.links if link.startswith('data:text/csv')]
    assert len(tables_within) == 4
    assert base64.b64decode(tables_within[0].split(',')[1]) == b'panel,3.8\n'


def test_part_of_a_reproduction_is_a_page_too(tmp_path):
    contents = reproduction(
        tmp_path,
        runs={},
        scoreboard='',
        scoreboard_summary='',
        maps=[],
        figures=[],
        seeds={},
        fast=True,
    )
    text = check_alone(write_index(tmp_path, contents)).text
    assert 'not asked for' in text
    assert 'quick form' in text
    assert 'The scoreboard was not measured' in findings(contents)


def test_verdicts_are_told_in_words_and_counted_by_chapter():
    board, summary = scoreboard.board(Thesis(amiss=walking(18.0)))
    found = counts(judged(board))
    assert [count.title[:9] for count in found] == ['Chapter 3', 'Chapter 5', 'Chapter 6']
    assert [count.missed for count in found] == [0, 1, 0]
    passed, all_judged = summary.split()[0], summary.split()[2]
    assert sum(count.passed for count in found) == int(passed)
    assert sum(count.passed + count.missed for count in found) == int(all_judged)
    html = str(markdown(board, Path()))
    assert html.count('<td class="miss"><strong>miss</strong></td>') == 1
    assert html.count('<td class="pass">pass</td>') == int(passed)
    assert '<h1>' not in html and '<a ' not in html


def test_markdown_takes_pictures_in_and_lets_no_html_through(tmp_path):
    figure(tmp_path, 'lines')
    html = str(
        markdown(
            '# Own title\n\n## Part\n\n![seen](lines.png) ![lost](absent.png)\n\n'
            '<b>bold</b> [word](http://example.org)',
            tmp_path,
        )
    )
    assert 'Own title' not in html
    assert '<h3>Part</h3>' in html
    assert 'src="data:image/png;base64,' in html
    assert 'lost' in html and 'absent.png' not in html
    assert '<b>' not in html and 'http' not in html and 'word' in html


@pytest.mark.parametrize(
    ('seconds', 'text'),
    [
        (12.4, '12 s'),
        (89.0, '89 s'),
        (150.0, '2 min'),
        (3600.0, '60 min'),
        (2 * 3600.0 + 300.0, '2 h 5 min'),
    ],
)
def test_durations(seconds, text):
    assert duration(seconds) == text


# ---- findings ----


def sections(contents):
    """Return the text of the findings by title."""
    parts = re.split(r'^## (.*)$', findings(contents), flags=re.MULTILINE)
    return dict(zip(['', *parts[1::2]], parts[::2], strict=True))


def test_opposite_outcomes_give_opposite_findings(tmp_path):
    agrees = sections(reproduction(tmp_path))
    differs = sections(reproduction(tmp_path, Opposite()))
    confirms, contradicts = 'What the simulation confirms', 'What it contradicts'
    for row in LIMITS:
        title = row.condition.title
        name = f'**{title[0].upper()}{title[1:]}**'
        assert name in agrees[confirms] and name not in agrees[contradicts]
        assert name in differs[contradicts] and name not in differs[confirms]
        assert f'in the thesis {row.thesis_deg:g}' in differs[contradicts]
    for row in TRENDS:
        assert row.what in agrees[confirms]
        assert row.what in differs[contradicts]
    assert 'It falls where the thesis walked' not in agrees[contradicts]
    assert 'It falls where the thesis walked' in differs[contradicts]
    assert 'It walks where the thesis fell' in differs[contradicts]
    assert 'toe force over phi, N' in differs[contradicts]
    assert '**Origin of the spectral lines**: The gait makes most' in agrees['What it adds']
    assert 'Nothing that was measured does.' in agrees[contradicts]
    judged_rows = [row for row in judged(scoreboard.board(Thesis())[0]) if row.passed is not None]
    assert f'Of {len(judged_rows)} rows of the thesis {len(judged_rows)} agree' in agrees['']


class Explained(Thesis):
    """A bench on which less friction takes a limit that misses near the thesis's."""

    def limit(self, condition, start, seeds=None):
        if condition.changes == ((('simulator', 'friction'), 0.15),):
            return Limit((9.5,), ())
        return super().limit(condition, start, seeds)


@pytest.mark.parametrize(
    ('kind', 'says'),
    [
        (Thesis, 'no change that was tried comes closer'),
        (Explained, 'closest with friction 0.15: 9.50 deg'),
    ],
)
def test_findings_quote_the_best_explanation(tmp_path, kind, says):
    text = sections(reproduction(tmp_path, kind(amiss=walking(18.0))))
    (line,) = [line for line in text['What it contradicts'].splitlines() if 'Walk, K_A 18' in line]
    assert 'it falls sooner, at 2.00 +- 0.00 deg, in the thesis 9.7 (-7.70)' in line
    assert says in line
    assert ('friction 0.15 +7.50' in text['What it adds']) == (kind is Explained)


def test_findings_are_one_page(tmp_path):
    for bench in (Thesis(), Opposite()):
        assert len(findings(reproduction(tmp_path, bench)).split()) < 900


def soles(smooth, rubber):
    return {
        'soles': [
            run(name, seed, verdict)
            for name, verdict in (
                ('walk_8.88deg_ka12', smooth),
                ('walk_8.88deg_ka12_rubber', rubber),
            )
            for seed in (0, 1)
        ]
    }


def test_soles_are_compared_as_they_came_out():
    (better,) = added(soles('fell', 'walked'))
    (worse,) = added(soles('slipped', 'fell'))
    assert 'at 8.88 deg (K_A 12) it stays up (2 of 2), slip 10 mm' in better
    assert 'falls (2 of 2) on smooth' in better
    assert 'it falls (2 of 2) on rubber, and stays up (2 of 2)' in worse


def test_a_run_of_several_experiments_counts_once():
    once = soles('walked', 'walked')
    assert '2 of 2' in added(once)[0]
    assert added(once | {'again': once['soles'][:2]}) == added(once)


def test_friction_tells_how_steep_the_ground_may_be():
    def runs(limits):
        return {
            'map': [
                run(
                    'walk_6.99deg_ka12',
                    0,
                    'walked' if phi <= limit else 'fell',
                    mu / 10,
                    simulator__friction=mu,
                    simulator__inclination_deg=phi,
                )
                for mu, limit in limits.items()
                for phi in (5.0, 6.0, 7.0)
            ]
        }

    (line,) = added(runs({0.1: 4.0, 0.2: 6.0}))
    assert '0.1: falls at 5 deg already; 0.2: stays up to 6 of 7 deg, slip 20 mm there' in line
    (line,) = added(runs({0.1: 7.0, 0.2: 5.0}))
    assert '0.1: stays up to 7 of 7 deg' in line and '0.2: stays up to 5 of 7 deg' in line


def test_staged_control_is_compared_on_tilting_ground():
    def line(staged_falls):
        return added(
            {
                'stages': [
                    run(
                        'stand_tilting_staged',
                        0,
                        'fell',
                        stage__mode='fixed',
                        stage__fixed_stage=1,
                    ),
                    run(
                        'stand_tilting_staged',
                        0,
                        'fell',
                        stage__mode='fixed',
                        stage__fixed_stage=2,
                    ),
                    run('stand_tilting_staged', 0, 'fell' if staged_falls else 'stood'),
                ]
            }
        )[0]

    assert 'no control falls at 2.12 deg' in line(True)
    assert 'K_A 12 falls at 2.12 deg' in line(True)
    assert 'staged, K_A 12, K_H 13 falls at 2.12 deg' in line(True)
    assert 'staged, K_A 12, K_H 13 stays up to 6.80 deg' in line(False)


def test_a_run_of_two_experiments_is_counted_once(tmp_path):
    shared, own = run('walk_3deg', 0), run('walk_3deg', 1)
    contents = reproduction(tmp_path, runs={'a': [shared], 'b': [shared, own]})
    assert contents.made == [shared.row, own.row]
    assert contents.run_seconds == shared.row['wall_time_s'] + own.row['wall_time_s']
    assert 'and 2 runs, which took' in findings(contents)
