"""The charts of a live page, and how it looks, in a real browser; one walk, then halted."""

import csv
import io
import re

import numpy as np
import pytest
from PIL import Image

from tests.support.browser import browser_page, chart, row, saved, slider, viewed_run
from tests.support.runs import wait_for

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]
DRAWN = 'window.__viserTestpoints.uplots'  # viser's own, for tests
SIZE = 'chart => [chart.width, chart.ctx.canvas.width]'
POINTS = 'chart => chart.data[0].length'
LEFT_TOE = "chart => chart.series.find((each) => each.label === 'left toe').show"
VERMILION = (213, 94, 0)
DELTA = 'Delta, toes less heels'
TITLES = ('Spectrum', 'Pitch rate', 'Foot forces', 'Delta', 'Corrections')


@pytest.fixture(scope='module')
def page(tmp_path_factory):
    """A walk whose first spectrum has come, halted when every chart has points."""
    folder = tmp_path_factory.mktemp('charts') / 'run'
    long = ('walk_3deg', '--set', 'gait.cycles=80', '--no-record')
    with viewed_run(folder, *long) as run, browser_page(1400, 850) as (page, _):
        page.goto(f'http://127.0.0.1:{run.port}/')
        slider(page, 'Ankle gain K_A').wait_for()
        page.get_by_text(re.compile('^line n = ')).first.wait_for()
        halt_with_points(page)
        yield page


def halt_with_points(page):
    """Halt the run while every chart has points: once halted, none gets more.

    A walk that begins again has no spectrum at first, and may do so before a slow browser halts it.
    """

    def all_have_points():
        return all((drawn(page, title, POINTS) or 0) > 10 for title in TITLES)

    while True:
        wait_for(all_have_points, 'points of all charts')
        page.get_by_role('button', name='Pause').click()
        page.get_by_text(re.compile('^paused at')).wait_for()
        if all_have_points():
            return
        page.get_by_role('button', name='Go on').click()
        page.get_by_text(re.compile('^paused at')).wait_for(state='hidden')


def drawn(page, title, what):
    """Return what JavaScript says of the uPlot chart whose title begins like this."""
    return page.evaluate(
        f"""title => {{
            const found = Object.values({DRAWN}).map((each) => each.chart)
                .find((each) => each.title.textContent.startsWith(title));
            return found && (({what})(found));
        }}""".replace('each.title.textContent', "each.root.querySelector('.u-title').textContent"),
        title,
    )


def choose(page, label, shown):
    """Show or hide a chart by its checkbox, among those that are folded away at first."""
    box = page.get_by_role('checkbox', name=label, exact=True)
    if not box.is_visible():
        page.get_by_text('Choose', exact=True).click()
    box.set_checked(shown)


@pytest.mark.parametrize('title', TITLES)
def test_every_axis_has_ticks_and_every_chart_its_units(page, title):
    for axis in (0, 1):

        def ticks(axis=axis):
            found = drawn(page, title, f'chart => chart.axes[{axis}]._values') or []
            return len([text for text in found if text]) >= 3

        wait_for(ticks, f'three ticks on axis {axis} of {title}')
    assert re.search('deg/s|N|deg', chart(page, title).locator('.u-title').inner_text())


RESIZE = """async chart => {
    const {width, height} = chart;
    const drawn = () => new Promise((done) => setTimeout(done, 100));
    chart.setSize({width: 0, height});
    await drawn();
    chart.setSize({width, height});
    chart.setData(chart.data, false);
    chart.redraw();
    await drawn();
    return chart.axes[0]._found[1];
}"""


@pytest.mark.parametrize('title', TITLES)
def test_an_axis_keeps_its_ticks_when_size_and_data_come_at_once(page, title):
    assert drawn(page, title, RESIZE) > 0


RESCALE = """async chart => {
    const {min, max} = chart.scales.x;
    const middle = (min + max) / 2;
    const range = async (max) => {
        chart.setScale('x', {min, max});
        chart.redraw();
        await new Promise((done) => setTimeout(done, 100));
        return chart.scales.x.max;
    };
    const found = await range(middle);
    await range(max);
    return found / middle;
}"""


def test_a_range_is_kept_if_data_come_at_once(page):
    assert drawn(page, 'Spectrum', RESCALE) == pytest.approx(1.0)


def test_a_chart_of_zeros_has_an_axis_to_one(page):
    """No controller acts in this walk."""
    assert drawn(page, 'Corrections', 'chart => [chart.scales.y.min, chart.scales.y.max]') == [
        0,
        1,
    ]


def test_the_cursor_shows_the_values_of_one_time_in_all_charts(page):
    chart(page, 'Foot forces').locator('.u-over').hover()

    def legend(title):
        """Return the values by label; there is no attempt before the first one."""
        of = chart(page, title).locator('.u-legend')
        labels, values = (
            of.locator(f'.u-{part}').all_inner_texts() for part in ('label', 'value')
        )
        return dict(zip(labels, values, strict=True)) | {'attempt before': '0'}

    of_forces, of_rate = legend('Foot forces'), legend('Pitch rate')
    assert len(of_forces) == 9 and len(of_rate) == 7
    assert of_forces['s'] == of_rate['s']
    assert all(
        re.fullmatch(r'-?[\d.,]+', text) for text in (*of_forces.values(), *of_rate.values())
    )


def test_a_click_in_the_legend_hides_a_line_and_another_shows_it(page):
    label = chart(page, 'Foot forces').locator('.u-legend .u-label', has_text='left toe')
    for shown in (False, True):
        label.click()
        wait_for(
            lambda wanted=shown: drawn(page, 'Foot forces', LEFT_TOE) is wanted,
            f'the line {"shown" if shown else "hidden"}',
        )


def test_a_drag_zooms_and_a_double_click_shows_all(page):
    over = chart(page, 'Pitch rate').locator('.u-over')
    box = over.bounding_box()
    middle = box['y'] + box['height'] / 2
    span = 'chart => chart.scales.x.max - chart.scales.x.min'
    whole = drawn(page, 'Pitch rate', span)
    page.mouse.move(box['x'] + 0.4 * box['width'], middle)
    page.mouse.down()
    page.mouse.move(box['x'] + 0.6 * box['width'], middle, steps=5)
    page.mouse.up()
    assert drawn(page, 'Pitch rate', span) == pytest.approx(0.2 * whole, rel=0.1)
    over.dblclick()
    wait_for(lambda: drawn(page, 'Pitch rate', span) == pytest.approx(whole), 'the whole')


def test_a_reader_chooses_the_charts_and_saves_what_is_chosen(page):
    choose(page, 'Joint ankle pitch', True)
    choose(page, 'Slip so far', True)
    choose(page, DELTA, False)
    chart(page, 'Joint ankle pitch').wait_for()
    chart(page, 'Slip so far').wait_for()
    chart(page, DELTA).wait_for(state='detached')
    samples = drawn(page, 'Joint ankle pitch', 'chart => chart.data[1].length')

    def columns():
        name, table = saved(page, 'Signals as CSV')
        assert name == 'signals.csv'
        return list(csv.reader(io.StringIO(table.decode())))

    table = wait_for(lambda: len((found := columns())[0]) == 22 and found, 'chosen columns')
    head, *rows = table
    assert head[0] == 'time, s' and 'Joint ankle pitch left, deg' in head
    assert not any(name.startswith(DELTA) for name in head)
    assert len(rows) == pytest.approx(samples, abs=10), (
        'the newest of one have come, of another not'
    )
    times = np.array([float(line[0]) for line in rows])
    assert np.diff(times) == pytest.approx(0.015)
    choose(page, DELTA, True)
    choose(page, 'Spectrum', False)
    chart(page, 'Spectrum').wait_for(state='detached')
    choose(page, 'Spectrum', True)
    chart(page, 'Spectrum').wait_for()


def test_the_spectrum_is_saved_with_its_peaks_named_in_the_page(page):
    name, table = saved(page, 'Spectrum as CSV')
    assert name == 'spectrum.csv'
    head, *rows = csv.reader(io.StringIO(table.decode()))
    assert head == ['frequency, Hz', 'pitch rate, deg/s']
    largest = max(float(amplitude) for _, amplitude in rows)
    assert largest > 1.0
    assert page.get_by_text(re.compile(r'^(line n = \d+|off the lines, n = [\d.]+)$')).count() > 1


def test_the_charts_are_saved_as_they_are_shown_at_the_size_of_a_slide(page):
    def sizes():
        return [drawn(page, title, SIZE) for title in TITLES]

    wait_for(lambda: all(width for width, _ in sizes()), 'all charts')
    before = sizes()
    name, content = saved(page, 'Charts as PNG')
    assert name == 'charts.png'
    picture = Image.open(io.BytesIO(content)).convert('RGB')
    count = page.locator('.uplot:visible').count()
    assert picture.width > 1400 and picture.height > 400 * (count // 2)
    assert pixels(picture, VERMILION) > 500, 'the right foot'
    heading = page.locator('[data-khr-title]').get_attribute('data-khr-title')
    assert re.match(r'Walking downhill at 3 deg.*, no control, at [\d.]+ s$', heading), heading
    assert pixels(picture.crop((0, 0, picture.width, 60)), (0, 0, 0)) > 500, 'the heading'
    assert sizes() == before, 'the charts of the page are as before'


def test_forces_and_support_can_be_hidden(page):
    """The robot stands still meanwhile: nothing else changes in the picture."""
    box = page.get_by_role('checkbox', name='Forces and balance')
    shown = middle_of(page)
    box.uncheck()
    wait_for(lambda: changed(shown, middle_of(page)) > 100, 'a robot without them')
    hidden = middle_of(page)
    box.check()
    wait_for(lambda: changed(hidden, middle_of(page)) > 100, 'a robot with them')


def test_the_page_becomes_dark_and_pale_again(page):
    scheme = "document.documentElement.getAttribute('data-mantine-color-scheme')"
    box = page.get_by_role('checkbox', name='Dark')
    box.check()
    wait_for(lambda: page.evaluate(scheme) == 'dark', 'the dark page')
    box.uncheck()
    wait_for(lambda: page.evaluate(scheme) == 'light', 'the pale page')


def changed(before, now):
    """Count the pixels that are of another colour than before."""
    return int((np.abs(np.asarray(before, int) - np.asarray(now, int)).max(axis=2) > 40).sum())


def pixels(picture, color, tolerance=40):
    far = np.abs(np.asarray(picture, dtype=int) - color).max(axis=2)
    return int((far <= tolerance).sum())


def middle_of(page):
    clip = {'x': 370, 'y': 0, 'width': 680, 'height': 850}
    return Image.open(io.BytesIO(page.screenshot(clip=clip))).convert('RGB')


def test_every_chart_has_a_scale_though_some_of_its_lines_have_no_data(page):
    """No node publishes a correction of the roll controller, and there is no earlier attempt."""
    scales = f'Object.values({DRAWN}).map(({{chart}}) => [chart.scales.y.min, chart.scales.y.max])'
    wait_for(
        lambda: all(None not in ends and ends[0] < ends[1] for ends in page.evaluate(scales)),
        'a scale of every chart',
    )


def enter(page, label, number):
    """Type a number into the box of a slider; return the slider."""
    box = row(page, label, 'input').locator('input').last
    box.click()
    box.press('Control+a')
    box.type(number)
    page.wait_for_timeout(500)
    yield slider(page, label)
    box.press('Enter')


@pytest.mark.parametrize(
    ('label', 'number', 'refusal'),
    [
        ('Ankle gain K_A', '99', 'ankle_controller: gain: 99.0 {}float in [0, 60]'),
        ('Inclination, deg', '-40', 'simulator: inclination_deg: -40.0 {}float in [-30, 30] deg'),
        ('Force, N', '99', 'push: force: 99.0 {}float in [0.5, 30] N'),
    ],
)
def test_a_number_out_of_range_is_refused_in_the_words_of_the_command(
    page, label, number, refusal
):
    halted = page.get_by_role('button', name='Go on')  # as the fixture leaves it
    if halted.is_visible():
        halted.click()
        page.get_by_role('button', name='Pause').wait_for()
    before = slider(page, label).get_attribute('aria-valuenow')
    for _ in enter(page, label, number):
        pass
    page.get_by_text(refusal.format('is not accepted; accepted: ')).wait_for()
    wait_for(lambda: slider(page, label).get_attribute('aria-valuenow') == before, 'the old value')
    state = page.locator('.khr-state').inner_text()
    wait_for(lambda: page.locator('.khr-state').inner_text() != state, 'a page that goes on')


@pytest.mark.parametrize('number', ['23', '7', '14.5'])
def test_a_number_acts_on_enter_and_not_on_every_key(page, number):
    """However many digits it has: viser's number box takes a longer one for a typing error."""
    before = slider(page, 'Ankle gain K_A').get_attribute('aria-valuenow')
    for thumb in enter(page, 'Ankle gain K_A', number):
        assert thumb.get_attribute('aria-valuenow') == before
    wait_for(lambda: thumb.get_attribute('aria-valuenow') == number, 'the gain')
