"""The generated documents are up to date, and stored results are rendered beside their data."""

import pytest

from khr_experiments.scoreboard import compare
from khr_report.docs_generator import generated
from khr_report.scoreboard_page import scoreboard_markdown, write_scoreboard
from tests import ROOT
from tests.fakes.benches import Thesis


@pytest.mark.parametrize('path', generated(ROOT), ids=lambda path: path.name)
def test_a_document_is_what_make_docs_writes(path):
    assert path.read_text(encoding='utf-8') == generated(ROOT)[path], 'run: make docs'


def test_stored_results_are_rendered_without_measuring(tmp_path):
    for name in ('README.md', 'CHANGELOG.md'):
        (tmp_path / name).write_text((ROOT / name).read_text())
    page = tmp_path / 'docs' / 'scoreboard.md'
    assert page not in generated(tmp_path)
    board = compare(Thesis())
    write_scoreboard(page, board)
    page.unlink()
    assert generated(tmp_path)[page] == scoreboard_markdown(board)
