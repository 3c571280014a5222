"""The page of a scoreboard agrees with its numbers, and its data lie beside it."""

from khr_studies.measuring.json_file import read_json
from khr_studies.measuring.thesis_values import walking
from khr_studies.scoreboard import page as scoreboard_page
from khr_studies.scoreboard.study import compare
from tests.fakes.benches import Thesis


def test_verdicts_are_counted_by_chapter():
    board = compare(Thesis(amiss=walking(18.0)))
    found = scoreboard_page.counts(board)
    assert [one['title'][:9] for one in found] == ['Chapter 3', 'Chapter 5', 'Chapter 6']
    assert [one['missed'] for one in found] == [0, 1, 1], 'the limit, and its order'
    every = scoreboard_page.count(board.rows)
    for name in ('passed', 'missed', 'undecided', 'unpublished'):
        assert sum(one[name] for one in found) == every[name]
    judged = every['passed'] + every['missed'] + every['undecided']
    assert every['judged'] == judged
    assert scoreboard_page.summary(board).startswith(f'{every["passed"]} of {judged} rows pass')
    text = scoreboard_page.scoreboard_markdown(board)
    assert text.count('| **miss** |') == 2 and text.count('| pass |') == every['passed']
    (row,) = [line for line in text.splitlines() if line.startswith('| 5 | walk, K_A 18 |')]
    assert '2.00 +- 0.20' in row and '-7.70' in row and '**miss**' in row


def test_page_and_data_lie_side_by_side(tmp_path):
    board = compare(Thesis())
    scoreboard_page.write(board, tmp_path / 'new' / 'board.md')
    text = (tmp_path / 'new' / 'board.md').read_text()
    assert text == scoreboard_page.scoreboard_markdown(board, 'board.json')
    assert '[board.json](board.json)' in text
    assert read_json(tmp_path / 'new' / 'board.json', type(board)) == board
