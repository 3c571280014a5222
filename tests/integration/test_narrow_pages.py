"""Pages on a phone: nothing is wider than the screen, and no cell covers another."""

import pytest

from khr_studies.reproduction.page import write_index
from tests.fakes.benches import Opposite
from tests.fakes.reproductions import reproduction
from tests.support.browser import browser_page

CELLS = """rows => rows.filter(row => row.offsetParent).map(row => [...row.children].map(cell => {
    const box = cell.getBoundingClientRect();
    return [box.left, box.top, box.right, box.bottom];
}))"""
ROWS = 'main > section > .wide tbody tr'  # not those in folded parts


@pytest.fixture(scope='module')
def page_of_results(tmp_path_factory):
    folder = tmp_path_factory.mktemp('page')
    return write_index(folder, reproduction(folder, Opposite()))


@pytest.fixture(scope='module')
def browser():
    with browser_page(390) as (page, asked):
        yield page, asked


@pytest.mark.parametrize('width', [390, 1400])
def test_tables_fit_the_screen_and_show_every_cell_and_on_a_phone_its_column(
    browser, page_of_results, width
):
    page, asked = browser
    page.set_viewport_size({'width': width, 'height': 800})
    asked.clear()
    page.goto(page_of_results.as_uri())
    assert page.evaluate('document.documentElement.scrollWidth') <= width
    rows = page.eval_on_selector_all(ROWS, CELLS)
    assert len(rows) > 30 and asked == [page_of_results.as_uri()]
    for row in rows:
        for number, (left, top, right, bottom) in enumerate(row):
            assert left >= 0 and right <= width
            for other in row[number + 1 :]:
                apart = (
                    other[0] >= right - 0.5
                    or other[2] <= left + 0.5
                    or other[1] >= bottom - 0.5
                    or other[3] <= top + 0.5
                )
                assert apart, (row[number], other)
    stacked = len({cell[0] for cell in rows[0][1:]}) == 1
    assert stacked == (width == 390)
    if stacked:
        names = page.eval_on_selector_all(
            f'{ROWS} td', "cells => cells.map(cell => getComputedStyle(cell, '::before').content)"
        )
        assert '"verdict"' in names and 'none' not in names
