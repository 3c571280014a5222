"""The page of a reproduction and the findings hold all results, and stand alone."""

import base64
from dataclasses import replace

import pytest

from khr_report.page.document import Passage, Table, markdown
from khr_studies.measuring.json_file import read_json, write_json
from khr_studies.measuring.limit import Limit
from khr_studies.measuring.thesis_values import LIMITS, TRENDS, walking
from khr_studies.reproduction import findings as results
from khr_studies.reproduction import findings_page
from khr_studies.reproduction.findings import Findings
from khr_studies.reproduction.page import write_index
from khr_studies.reproduction.results import distinct
from khr_studies.scoreboard import page as scoreboard_page
from khr_studies.stability_map import page as map_page
from khr_studies.stability_map.best_gain import BestGains, MapLimits
from tests.fakes.benches import Opposite, Thesis
from tests.fakes.reproductions import CELL, EMPTY, SOLES, findings, reproduction, run
from tests.support.pages import check_alone

# ---- the page of a reproduction ----


def cells(blocks):
    """Yield all cells of a document."""
    for block in blocks:
        if isinstance(block, Passage):
            yield from cells(block.blocks)
        elif isinstance(block, Table):
            yield from (str(cell) for row in (block.head, *block.rows) for cell in row)


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
            assert (
                f'data:image/png;base64,{base64.b64encode(each.image.read_bytes()).decode()}'
                in page.sources
            )
            assert each.command in page.text
    assert 'figures/3.8.csv' in page.links
    board = made.findings.scoreboard
    for document in (
        scoreboard_page.blocks(board),
        findings_page.blocks(made.findings),
        *map(map_page.blocks, made.findings.maps.values()),
    ):
        for cell in cells(document):
            assert ' '.join(cell.split()) in page.text
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


def test_part_of_a_reproduction_is_a_page_too(tmp_path):
    made = reproduction(tmp_path, runs={}, maps=[], figures=[], seeds={}, findings=EMPTY)
    text = check_alone(write_index(tmp_path, made)).text
    assert 'quick form' in text
    assert 'The scoreboard was not measured' in text


# ---- findings ----


def sections(made):
    """Return the text of the findings by title."""
    parts = [part for part in findings_page.blocks(made) if isinstance(part, Passage)]
    return {part.title: markdown(part.blocks) for part in parts}


CONFIRMS, CONTRADICTS = 'What the simulation confirms', 'What it contradicts'
ADDS = 'What it adds'


def test_opposite_outcomes_give_opposite_findings():
    agrees, differs = sections(findings()), sections(findings(Opposite()))
    for row in LIMITS:
        name = f'| {row.condition.title} | {row.thesis_deg:g} |'
        assert name in agrees[CONFIRMS] and name not in agrees[CONTRADICTS]
        assert name in differs[CONTRADICTS] and name not in differs[CONFIRMS]
    for row in TRENDS:
        assert row.what in agrees[CONFIRMS]
        assert row.what in differs[CONTRADICTS]
    assert agrees[CONTRADICTS] == findings_page.NOTHING
    assert '| toe force |' in differs[CONTRADICTS]
    assert '| gait line 6: the gait | high |' in agrees[ADDS]
    judged = [row for row in findings().scoreboard.rows if row.passed is not None]
    answer = findings_page.blocks(findings())[1]
    assert f'Of {len(judged)} rows of the thesis {len(judged)} agree' in answer


class Explained(Thesis):
    """A bench on which less friction takes a limit that misses near the thesis's."""

    def limit(self, condition, seeds=None):
        if condition.changes == ((('simulator', 'friction'), 0.18),):
            return Limit((9.5,), ())
        return super().limit(condition, seeds)


@pytest.mark.parametrize(
    ('kind', 'says'), [(Thesis, 'none of them'), (Explained, 'friction 0.18: 9.50')]
)
def test_findings_name_the_best_explanation(kind, says):
    text = sections(findings(kind(amiss=walking(18.0))))
    (line,) = [line for line in text[CONTRADICTS].splitlines() if 'walk, K_A 18' in line]
    assert line.startswith('| walk, K_A 18 | 9.7 | 2.00 +- 0.20 |')
    assert '| -7.70 |' in line and line.endswith(f'| {says} |')
    assert ('| friction 0.18 | +7.50 |' in text[ADDS]) == (kind is Explained)


def test_findings_are_the_same_after_their_file(tmp_path):
    made = findings(
        Thesis(amiss=walking(18.0)), soles=results.compare_soles(soles('fell', 'walked')['soles'])
    )
    mapped = replace(EMPTY, maps={'soles': SOLES, 'bisected': MapLimits('a.b', SOLES.limits)})
    for each in (made, mapped, EMPTY):
        write_json(tmp_path / 'findings.json', each)
        assert read_json(tmp_path / 'findings.json', Findings) == each


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
    (better,) = results.compare_soles(soles('fell', 'walked')['soles'])
    (worse,) = results.compare_soles(soles('slipped', 'fell')['soles'])
    assert (better.inclination_deg, better.control) == (8.88, 'K_A 12')
    assert better.rubber == results.Tally(2, 0, 10.0, 0.1)
    assert better.smooth == results.Tally(2, 2, None, None)
    assert worse.rubber == better.smooth and worse.smooth == better.rubber
    text = sections(findings(soles=(better,)))[ADDS]
    assert (
        '| 8.88 | K_A 12 | stays up (2 of 2) | 10 | 5.7 | falls or rides down (2 of 2) | - | - |'
        in text
    )


def test_a_run_of_several_experiments_counts_once():
    once = soles('walked', 'walked')['soles']
    assert results.compare_soles(once)[0].rubber.runs == 2
    assert results.compare_soles([*once, *once[:2]]) == results.compare_soles(once)


def test_friction_decides_how_steep_the_ground_may_be():
    def compared(limits, beyond='fell', slip=0.0):
        return results.compare_friction(
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

    slick, rough = compared({0.1: 4.0, 0.2: 6.0})
    assert (slick.friction, slick.steepest_deg, slick.slip_mm) == (0.1, None, None)
    assert (rough.friction, rough.steepest_deg, rough.tried_deg) == (0.2, 6.0, (5.0, 7.0))
    assert rough.slip_mm == pytest.approx(20.0)
    text = sections(findings(friction=(slick, rough)))[ADDS]
    assert '| K_A 12 | 0.1 | not at 5 already | - |' in text
    assert '| K_A 12 | 0.2 | 6 of 7 | 20 |' in text
    assert [each.steepest_deg for each in compared({0.1: 7.0, 0.2: 5.0})] == [7.0, 5.0]
    riding = compared({0.1: 4.0, 0.2: 6.0}, 'slipped', 13.0)
    assert [each.steepest_deg for each in riding] == [None, 6.0], 'who rides has not stayed up'


def test_staged_control_is_compared_on_tilting_ground():
    def compared(staged_falls):
        return results.compare_tilting(
            [
                run('stand_tilting_staged', 0, 'fell', stage__mode='fixed', stage__fixed_stage=1),
                run('stand_tilting_staged', 0, 'fell', stage__mode='fixed', stage__fixed_stage=2),
                run('stand_tilting_staged', 0, 'fell' if staged_falls else 'stood'),
            ]
        )

    none, ankle, staged = compared(True)
    assert [(each.control, each.staged) for each in (none, ankle, staged)] == [
        ('no control', False),
        ('K_A 12', False),
        ('K_A 12, K_H 13', True),
    ]
    assert all(
        not each.stays and each.deg == pytest.approx(2.125) for each in (none, ankle, staged)
    )
    (*_, stays) = compared(False)
    assert stays.stays and stays.deg == pytest.approx(6.8)
    text = sections(findings(tilting=(none, stays)))[ADDS]
    assert '| no control | no | falls or rides down by 2.12 deg |' in text
    assert '| K_A 12, K_H 13 | yes | stays up to 6.80 deg |' in text
    assert results.compare_tilting([]) == ()


def test_a_run_of_two_experiments_is_counted_once():
    shared, own = run('walk_3deg', 0), run('walk_3deg', 1)
    assert distinct({'a': [shared], 'b': [shared, own]}) == [shared.row, own.row]
    again, other = run('walk_3deg', 0), run('walk_3deg', 0, gait__stride=0.05)
    other.row.update(shared.row)
    assert distinct({'a': [shared], 'b': [again, other]}) == [again.row, other.row]


# ---- maps ----


def test_best_gains_are_a_table_and_name_where_nothing_helps():
    table, text = map_page.blocks(BestGains('K_A', (CELL,), (8.0, 9.0)))
    assert table.head[1] == 'best K_A'
    assert table.rows == (('5', '15', '2 of 3 (21% to 94%)', '1 of 2', '7.2'),)
    assert 'No seed stays up on 8, 9 deg' in text
    assert 'No seed' not in map_page.blocks(BestGains('K_A', (CELL,), ()))[1]


def test_rubber_is_put_beside_smooth():
    _, soles_table, limits, text = map_page.blocks(SOLES)
    assert soles_table.rows[0] == ('5', '2 of 3', '20', '7.2', '2 of 3', '20', '7.2')
    assert soles_table.rows[1][4:] == ('-', '-', '-')
    assert limits.rows == (('0.18', '7.00', 'from 6.50'), ('0.8', '-', 'open'))
    assert 'up to 5 deg' in text and 'slip by - and the vibration by 1.00' in text
    apart = map_page.blocks(replace(SOLES, both_up_to_deg=None))
    assert apart[-1] == 'On no ground do runs stay up with both soles.'
