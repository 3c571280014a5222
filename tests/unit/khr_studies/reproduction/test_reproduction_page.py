"""The page of a reproduction and the findings hold all results, and stand alone."""

import base64
from dataclasses import replace

import pandas as pd
import pytest

from khr_common import RunError
from khr_report.page.document import markdown
from khr_studies.measuring.critical import Limit
from khr_studies.measuring.json_file import read_json, write_json
from khr_studies.measuring.run_table import run_table
from khr_studies.measuring.thesis_values import LIMITS, STAGE_2, walking
from khr_studies.measuring.thesis_walks import TRENDS
from khr_studies.reproduction import findings as results
from khr_studies.reproduction import findings_page, reproduce
from khr_studies.reproduction.experiment_plan import parse_plan
from khr_studies.reproduction.findings import Findings
from khr_studies.reproduction.page import write, write_index
from khr_studies.reproduction.reproduce import Computed
from khr_studies.scoreboard import page as scoreboard_page
from khr_studies.stability_map import page as map_page
from khr_studies.stability_map.study import MapResult
from tests.fakes.benches import Opposite, Thesis
from tests.fakes.reproductions import CELL, EMPTY, SOLES, findings, reproduction, run
from tests.fakes.reproductions import soles as sole_record
from tests.support.pages import check_alone

# ---- the page of a reproduction ----


def rows_of(text):
    """Return the rows of the tables of a document, heads among them."""
    lines = [line for line in text.splitlines() if line.startswith('| ')]
    return [line[2:-2].split(' | ') for line in lines if not line.startswith('| ---')]


def test_page_holds_every_figure_row_and_run_and_stands_alone(tmp_path):
    made = reproduction(tmp_path, Thesis(amiss=walking(18.0)))
    path = write_index(tmp_path, made)
    assert path == tmp_path / 'index.html'
    page = check_alone(path)
    for each in made.drawn:
        assert each.title in page.text
        if each.error:
            assert each.error in page.text
        else:
            picture = base64.b64encode(each.image.read_bytes()).decode()
            assert f'data:image/png;base64,{picture}' in page.sources
            assert each.command in page.text
    assert 'figures/3.8.csv' in page.links
    board = made.findings.scoreboard
    for document in (
        scoreboard_page.blocks(board),
        findings_page.blocks(made.findings),
        *map(map_page.blocks, made.findings.maps.values()),
    ):
        for cell in (cell for row in rows_of(markdown(document)) for cell in row):
            assert ' '.join(cell.strip('*').split()) in page.text
    for some in made.runs.values():
        assert all(each.row['trajectory_hash'] in page.text for each in some)
    for word in ('fell at 4.25 s', '13 min', 'abcdef', 'khr reproduce', 'Chapter 5: walking'):
        assert word in page.text
    assert scoreboard_page.summary(board) in page.text
    assert '#runs-a' in page.links and '](' not in page.text


def test_csv_outside_the_page_s_folder_is_taken_in(tmp_path):
    made = reproduction(tmp_path / 'made')
    page = check_alone(write_index(tmp_path / 'report', made))
    within = [link for link in page.links if link.startswith('data:text/csv')]
    assert len(within) == 5
    assert base64.b64decode(within[0].split(',')[1]) == b'panel,3.8\n'


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
        assert write(results, out, out / 'findings.md').startswith(str(out / 'index.html'))
        text = check_alone(out / 'index.html').text
        assert 'quick form' in text and 'The scoreboard was not measured' in text
        return
    with pytest.raises(RunError, match='no page is written'):
        reproduce.reproduce(asked, out)
    assert not [path for path in out.rglob('*') if path.is_file()]
    assert 'stand, K_A 12 at 7.6 deg, seed 0: stays up by a row' in capsys.readouterr().err


# ---- findings ----


def sections(made):
    """Return the text of the findings by title."""
    _, *parts = markdown(findings_page.blocks(made)).split('\n\n## ')
    return dict(part.split('\n\n', 1) for part in parts)


CONFIRMS, CONTRADICTS = 'Confirmed by the simulation', 'Contradicted'
ADDS = 'Beyond the thesis'


def test_opposite_outcomes_give_opposite_findings():
    found = findings(), findings(Opposite())
    agrees, differs = map(sections, found)
    for row in LIMITS:
        name = f'| {row.source} | {row.condition.title} | {row.thesis_deg:g} |'
        assert name in agrees[CONFIRMS] and name not in agrees[CONTRADICTS]
        assert name in differs[CONTRADICTS] and name not in differs[CONFIRMS]
    for row in TRENDS:
        assert row.name in agrees[CONFIRMS]
        assert row.name in differs[CONTRADICTS]
    assert agrees[CONTRADICTS] == findings_page.NO_ROW
    assert '| toe force |' in differs[CONTRADICTS]
    assert '| gait line 6: the gait | high |' in agrees[ADDS]
    for each, column in zip(found, (1, 2), strict=True):
        _, totals, counts, *_ = findings_page.blocks(each)
        assert totals.startswith(scoreboard_page.totals(each.scoreboard.rows))
        rows = {row[0]: row for row in rows_of(counts)}
        assert rows['Trends'][column] == str(len(TRENDS)) and rows['Trends'][3 - column] == '0'


class Explained(Thesis):
    """A bench on which less friction takes a limit that misses near the thesis's."""

    def limit(self, condition, seeds=None, job=None):
        if condition.changes == ((('simulator', 'friction'), 0.18),):
            return Limit((9.5,))
        return super().limit(condition, seeds)


@pytest.mark.parametrize(
    ('kind', 'says'), [(Thesis, 'no change'), (Explained, 'friction 0.18: 9.50')]
)
def test_findings_name_the_best_explanation(kind, says):
    text = sections(findings(kind(amiss=walking(18.0))))
    (line,) = [line for line in text[CONTRADICTS].splitlines() if 'walk, K_A 18' in line]
    assert line.startswith('| 5.2.4 | walk, K_A 18 | 9.7 | 2.00 +- 0.20 |')
    assert '| -7.70 |' in line and line.endswith(f'| {says} |')
    assert ('| friction 0.18 | +7.50 |' in text[ADDS]) == (kind is Explained)


def test_findings_are_the_same_after_their_file(tmp_path):
    made = findings(
        Thesis(amiss=walking(18.0)), soles=results.compare_soles(soles('fell', 'walked'))
    )
    mapped = replace(
        EMPTY, maps={'soles': SOLES, 'bisected': MapResult('a.b', limits=SOLES.limits)}
    )
    for each in (made, mapped, EMPTY):
        write_json(tmp_path / 'findings.json', each)
        again = read_json(tmp_path / 'findings.json', Findings)
        assert findings_page.findings_markdown(again) == findings_page.findings_markdown(each)
        assert again.scoreboard == each.scoreboard and len(again.soles) == len(each.soles)


def table(*runs):
    return results.experiment_table({'some': list(runs)})


def soles(smooth, rubber):
    scenarios = (('walk_8.88deg_ka12', smooth), ('walk_8.88deg_ka12_rubber', rubber))
    return table(*(run(name, seed, verdict) for name, verdict in scenarios for seed in (0, 1)))


def test_soles_are_compared_by_their_tallies():
    (better,) = results.compare_soles(soles('fell', 'walked'))
    (worse,) = results.compare_soles(soles('slipped', 'fell'))
    assert (better['inclination_deg'], better['control']) == (8.88, 'K_A 12')
    assert (better['runs_rubber'], better['lost_rubber'], better['lost_smooth']) == (2, 0, 2)
    assert better['largest_slip_m_rubber'] == 0.01 and better['largest_slip_m_smooth'] is None
    assert (worse['lost_rubber'], worse['lost_smooth'], worse['slipped_smooth']) == (2, 0, 2)
    text = sections(replace(EMPTY, soles=(better,)))[ADDS]
    assert 'stays up (2 of 2)' in text and 'falls or rides down (2 of 2)' in text
    once = soles('fell', 'walked')
    assert results.compare_soles(once[:2]) == [], 'smooth soles alone'
    twice = pd.concat([once, once[:2]])
    assert results.compare_soles(twice) == [better], 'a run of two experiments counts once'


def test_friction_decides_how_steep_the_slope_may_be():
    def compared(limits, beyond='fell', slip=0.0):
        walks = (
            run(
                'walk_6.99deg_ka12',
                0,
                'walked' if phi <= limit else beyond,
                mu / 10 if phi <= limit else slip,
                simulator__friction=mu,
                simulator__inclination_deg=phi,
            )
            for mu, limit in limits.items()
            for phi in (5.0, 6.0, 7.0)
        )
        return results.compare_friction(table(*walks))

    slick, rough = compared({0.1: 4.0, 0.2: 6.0})
    assert (slick['friction'], slick['steepest_deg'], slick['largest_slip_m']) == (0.1, None, None)
    assert (rough['friction'], rough['steepest_deg']) == (0.2, 6.0)
    assert (rough['gentlest_tried_deg'], rough['steepest_tried_deg']) == (5.0, 7.0)
    assert rough['largest_slip_m'] == pytest.approx(0.02)
    text = sections(replace(EMPTY, friction=(slick, rough)))[ADDS]
    assert 'not even at 5' in text and '6 of 7' in text
    assert [each['steepest_deg'] for each in compared({0.1: 7.0, 0.2: 5.0})] == [7.0, 5.0]
    riding = compared({0.1: 4.0, 0.2: 6.0}, 'slipped', 13.0)
    assert [each['steepest_deg'] for each in riding] == [None, 6.0], 'a robot that rides is lost'
    assert compared({0.1: 6.0}) == [], 'one friction compares nothing'


def test_staged_control_is_compared_on_a_tilting_slope():
    def compared(staged_verdict):
        return results.compare_tilting(
            table(
                run('stand_tilting_staged', 0, 'fell', stage__mode='fixed', stage__fixed_stage=1),
                run('stand_tilting_staged', 0, 'fell', stage__mode='fixed', stage__fixed_stage=2),
                run('stand_tilting_staged', 0, staged_verdict),
            )
        )

    found = compared('fell')
    assert [(each['control'], each['staged']) for each in found] == [
        ('no control', False),
        ('K_A 12', False),
        ('K_A 12, K_H 13', True),
    ]
    assert all(not each['stays'] and each['deg'] == pytest.approx(2.125) for each in found)
    (*_, stays) = compared('stood')
    assert stays['stays'] and stays['deg'] == pytest.approx(6.8)
    text = sections(replace(EMPTY, tilting=(found[0], stays)))[ADDS]
    assert 'falls or rides down by 2.12 deg' in text and 'stays up to 6.80 deg' in text
    assert not results.compare_tilting(table())


# ---- maps ----


def test_rubber_is_compared_with_smooth():
    _, soles_table, limits, text = map_page.blocks(SOLES)
    _, both, smooth = rows_of(soles_table)
    assert both[1:4] == both[4:] and smooth[4:] == ['-', '-', '-']
    assert rows_of(limits)[1:] == [['0.18', '7.00', 'from 6.50'], ['0.8', '-', 'open']]
    assert 'up to 5 deg' in text and 'slip by 1.00 and the vibration by 1.00' in text
    gripping = sole_record(5.0, CELL | {'largest_slip_m': 0.0}, CELL | {'largest_slip_m': 0.0})
    assert 'slip by - and' in map_page.blocks(replace(SOLES, soles=(gripping,)))[-1]
    apart = replace(SOLES, soles=({**SOLES.soles[0], 'up_rubber': 0}, SOLES.soles[1]))
    assert map_page.blocks(apart)[-1].startswith('There is no inclination')
