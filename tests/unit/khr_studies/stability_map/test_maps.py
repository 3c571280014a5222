"""Stability maps: where a share crosses one half, what is counted, drawn and written."""

import csv
import math
from collections import Counter
from functools import partial
from itertools import product

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from khr.cli.verbs.studies import draw_stability_map
from khr_analysis.outcome import MonitorParameters
from khr_common.errors import KhrError
from khr_studies.measuring.experiments import specification_of
from khr_studies.measuring.run_table import run_table, tally
from khr_studies.stability_map.figure import figure
from khr_studies.stability_map.page import (
    SLIP,
    VIBRATION,
    Slope,
    draw_map,
    gains_page,
    slope_gains,
    write_gains,
)
from khr_studies.stability_map.study import (
    RUBBER,
    SMOOTH,
    best_cells,
    crossing,
    map_result,
    stability_map,
)
from khr_sweeps.results.folder import Folder, read_results
from khr_sweeps.trial import RESULTS
from tests.fakes.benches import outcome

X, Y, Z = 'simulator.inclination_deg', 'ankle_controller.gain', 'simulator.surface'
HIP, MU = 'hip_controller.gain', 'simulator.friction'
INCLINATIONS, GAINS, SURFACES = [0.0, 4.0, 8.0, 12.0], [6.0, 12.0, 18.0], ['smooth', 'rubber']
RUNS = 5


def verdict(inclination, gain, number):
    """Survives up to an inclination that grows with the gain; slips in its last 4 deg."""
    limit = 2.0 + gain / 3.0 + (number - 2)
    return 'fell' if inclination > limit else 'slipped' if inclination > limit - 4 else 'walked'


def row_of(inclination, gain, surface, number):
    found = verdict(inclination, gain, number)
    return {
        'id': f'{inclination} {gain} {surface} {number}',
        X: inclination,
        Y: gain,
        Z: surface,
        'seed': number,
        **dict.fromkeys(RESULTS),
        'verdict': found,
        'stayed_up': found != 'fell',
        'fell_at_s': 10.0 - inclination / 2 if found == 'fell' else None,
        'vibration_rad_s': gain / 100,
    }


def request(axes, samples=None):
    return {
        'version': 'v',
        'scenario': {'walk_3deg': {}},
        'cases': {},
        'axes': axes,
        'samples': samples,
        'seeds': RUNS,
    }


@pytest.fixture
def folder(tmp_path):
    rows = [row_of(*each) for each in product(INCLINATIONS, GAINS, SURFACES, range(RUNS))]
    refused = {'verdict': None, 'stayed_up': None, 'error': 'no such gait'}
    rows.append(row_of(0.0, 6.0, 'smooth', 99) | refused)
    with Folder(tmp_path / 'sweep', request({Y: GAINS[::-1], X: INCLINATIONS, Z: SURFACES})) as it:
        it.append(rows)
        it.export()
    return tmp_path / 'sweep'


def read_csv(path):
    with path.open(encoding='utf-8') as file:
        return list(csv.DictReader(file))


# ---- the map ----


def test_every_run_with_an_outcome_is_counted_once(folder):
    counted = stability_map(read_results(folder), X, Y)
    assert counted.y.labels == tuple(GAINS)  # sorted, however they were given
    assert counted.pooled == (Z,)
    assert (counted.of('runs') == RUNS * len(SURFACES)).all()
    for i, gain in enumerate(GAINS):
        for j, inclination in enumerate(INCLINATIONS):
            each = Counter(verdict(inclination, gain, number) for number in range(RUNS))
            assert counted.of('up')[i, j] == 2 * (RUNS - each['fell'])
            assert counted.of('slipped')[i, j] == 2 * each['slipped']
            assert np.array_equal(
                counted.of('vibration_rad_s')[i, j],
                gain / 100 if each['fell'] < RUNS else np.nan,
                equal_nan=True,
            )
            assert (counted.of('fell_at_s')[i, j] == 10.0 - inclination / 2) == (each['fell'] > 0)
    for gain, critical in zip(GAINS, counted.critical, strict=True):
        assert critical.low < 2.0 + gain / 3.0 < critical.high


def test_where_takes_the_runs_of_one_value_and_pooling_is_announced(folder, tmp_path):
    counted = stability_map(read_results(folder), X, Y, {Z: 'rubber'})
    assert counted.pooled == () and (counted.of('runs') == RUNS).all()
    notes = []
    assert f'{Z} = rubber' in figure(counted).legends[0].get_title().get_text()
    draw_map(folder, X, Y, tmp_path / 'map.svg', {Z: 'rubber'}, notes.append)
    assert not notes and (tmp_path / 'map.svg').read_bytes().startswith(b'<?xml')
    draw_map(folder, X, Y, None, None, notes.append)
    assert notes == [f'pooled over all values of {Z}; for one of them: --where {Z}=VALUE']


def test_the_command_selects_cases_as_its_note_says(tmp_path, capsys):
    labels = ['1', 'yes', 'a=b']  # none of which is to be read as YAML
    rows = [
        {**row_of(x, y, 'smooth', 2), 'id': f'{x} {y} {label}', 'case': label}
        for x, y, label in product([4.0, 8.0], [6.0, 18.0], labels)
    ]
    with Folder(
        tmp_path / 'sweep', request({'case': labels, X: [4.0, 8.0], Y: [6.0, 18.0]})
    ) as folder:
        folder.append(rows)
    draw = partial(draw_stability_map, tmp_path / 'sweep', X, Y)
    draw(tmp_path / 'all.svg')
    assert '; for one of them: --where case=VALUE' in capsys.readouterr().out
    for label in labels:
        draw(tmp_path / f'{label}.svg', [f'case={label}'])
        assert sum(int(row['runs']) for row in read_csv(tmp_path / f'{label}.csv')) == 4
    with pytest.raises(KhrError, match=r'accepted: case=1 \| yes \| a=b$'):
        draw(None, ['case=2'])


@pytest.mark.parametrize('where', [{Z: 'ice'}, {X: 4.0}])
def test_where_refuses_with_the_values_of_the_sweep(folder, where):
    with pytest.raises(
        KhrError, match=r'--where: .*accepted: simulator\.surface=smooth \| rubber$'
    ):
        stability_map(read_results(folder), X, Y, where)


@pytest.mark.slow
def test_files_hold_what_was_counted(folder, tmp_path):
    image, cells, critical, gains = draw_map(folder, X, Y, tmp_path / 'new' / 'map.png')
    assert image.read_bytes().startswith(b'\x89PNG')
    rows = read_csv(cells)
    assert len(rows) == len(INCLINATIONS) * len(GAINS)
    assert sum(int(row['runs']) for row in rows) == 120
    for row in rows:
        low, high = float(row['share_up_low_95']), float(row['share_up_high_95'])
        assert low <= float(row['share_up']) <= high
        assert int(row['stayed_up']) + int(row['lost']) == int(row['runs'])
    assert [float(row[Y]) for row in read_csv(critical)] == GAINS
    assert [(float(row[X]), float(row[f'best {Y}'])) for row in read_csv(gains)] == [
        tuple(pair)
        for pair in stability_map(read_results(folder), X, Y).best[['x', 'y']].to_numpy()
    ]


def bisected(tmp_path, bisect):
    """Return the map of runs along the limits of two gains."""
    places = [(4.0, 6.0), (8.0, 6.0), (4.0, 18.0), (8.0, 18.0), (12.0, 18.0)]
    axes = {X: INCLINATIONS, Y: [6.0, 18.0], Z: SURFACES}
    with Folder(tmp_path / f'sweep{bisect}', {**request(axes), 'bisect': bisect}) as folder:
        folder.append(row_of(*place, 'smooth', 2) for place in places)
    return stability_map(read_results(tmp_path / f'sweep{bisect}'), X, Y)


def test_what_a_bisection_takes_for_granted_is_filled_palely(tmp_path):
    counted, plain = bisected(tmp_path, X), bisected(tmp_path, '')
    nan = math.nan  # was run, or is between
    np.testing.assert_array_equal(counted.implied(), [[1.0, nan, nan, 0.0], [1.0, nan, nan, nan]])
    assert np.isnan(plain.implied()).all()
    assert counted.best.empty and len(plain.best)
    pale = [each for each in figure(counted).axes[0].collections if each.get_alpha()]
    assert len(pale) == 1 and pale[0].get_array().count() == np.isfinite(counted.implied()).sum()


@pytest.mark.slow
def test_four_panels_name_their_axes_and_mark_best_gains_and_split_cells(folder):
    counted = stability_map(read_results(folder), X, Y)
    page = figure(counted)
    page.draw_without_rendering()
    panels = page.axes[:4]
    assert len({panel.get_title() for panel in panels}) == 4
    assert panels[2].get_xlabel() == 'inclination φ (°)'
    assert panels[2].get_ylabel() == 'ankle gain K_A'
    assert 'walk_3deg' in page.get_suptitle()
    hatched = [each for each in panels[0].collections if each.get_hatch()]
    assert len(hatched) == counted.split().sum() > 0
    assert not counted.split()[2, 0]  # 10 of 10 survive
    stars = [
        line for line in panels[0].lines if line.get_marker() == '*' and len(line.get_xdata())
    ]
    assert [list(line.get_xdata()) for line in stars] == [counted.best['x'].tolist()]
    assert 'best K_A: 12 at 0°, 18 at 4°' in page.legends[0].get_title().get_text()
    assert stability_map(read_results(folder), Y, X).best.empty


@pytest.mark.slow
def test_words_make_an_axis_too(folder, tmp_path):
    counted = stability_map(read_results(folder), X, Z)
    assert counted.y.labels == tuple(SURFACES) and len(counted.critical) == 2
    sideways = stability_map(read_results(folder), Z, Y)
    assert sideways.critical == ()
    assert len(draw_map(folder, Z, Y, tmp_path / 'words.png')) == 2


PUSHES, PUSH = 'simulator.pushes', 't=1 duration=0.1 link=base_link frame=odom force=1,0,0'


@pytest.fixture
def pushed(tmp_path):
    """Write a sweep over inclination, gain and lists of pushes; return its folder."""
    axes = {X: [4.0, 8.0], Y: [6.0, 18.0], PUSHES: [[''], [PUSH], [PUSH, PUSH]]}
    with Folder(tmp_path / 'sweep', request(axes)) as folder:
        folder.append(
            {**row_of(x, y, 'smooth', 2), 'id': f'{x} {y} {pushes}', PUSHES: pushes}
            for x, y, pushes in product(*axes.values())
        )
    return tmp_path / 'sweep'


def test_lists_make_an_axis_and_select_runs_too(pushed):
    counted = stability_map(read_results(pushed), X, PUSHES, {Y: 18.0})
    assert (counted.of('runs') == 1).all() and counted.of('runs').shape == (3, 2)
    figure(counted)
    one = stability_map(read_results(pushed), X, Y, {PUSHES: [PUSH]})
    assert (one.of('runs') == 1).all() and one.pooled == ()


def test_gains_are_listed_for_each_list(pushed):
    slopes = slope_gains(read_results(pushed))
    assert len(slopes) == 2 * 3 and {len(each.cells) for each in slopes} == {2}
    assert gains_page(slopes).startswith('| pushes | inclination, deg |')


def test_draws_are_gathered_in_bins_that_lose_none(tmp_path):
    generator = np.random.default_rng(1)
    places = [*generator.uniform((0.0, 6.0), (12.0, 18.0), (300, 2)).tolist(), [12.0, 18.0]]
    rows = [row_of(*place, None, number % RUNS) for number, place in enumerate(places)]
    for row in rows:
        del row[Z]
    axes = {X: {'low': 0.0, 'high': 12.0}, Y: {'low': 6.0, 'high': 18.0}}
    with Folder(tmp_path, request(axes, 301)) as folder:
        folder.append(rows)
    counted = stability_map(read_results(tmp_path), X, Y)
    assert counted.of('runs').sum() == 301 and counted.of('runs').shape == (6, 6)
    assert counted.of('up').sum() == sum(row['stayed_up'] for row in rows)
    assert (counted.x.edges[0], counted.x.edges[-1]) == (0.0, 12.0)


@pytest.mark.parametrize(('x', 'y', 'says'), [(X, 'gain', "--y: 'gain'"), (X, X, f"--x: '{X}'")])
def test_what_is_not_swept_is_refused(folder, x, y, says):
    with pytest.raises(KhrError) as refusal:
        draw_map(folder, x, y)
    assert says in str(refusal.value) and f'{Y}, {X}, {Z}' in str(refusal.value)


def test_an_empty_sweep_and_no_sweep_are_named(tmp_path):
    with Folder(tmp_path / 'sweep', request({X: INCLINATIONS, Y: GAINS})):
        pass
    with pytest.raises(KhrError, match='no run'):
        draw_map(tmp_path / 'sweep', X, Y)
    with pytest.raises(KhrError, match='no results of a sweep'):
        draw_map(tmp_path, X, Y)


def results(tmp_path, axes):
    """Return runs in which K_A 12 holds 8 deg, and no gain 20 deg; K_H costs vibration."""
    rows = []
    tried = product(range(2), axes[X], axes.get(Y, [0.0]), axes.get(HIP, [0.0]))
    for number, slope, ankle, hip in tried:
        up = slope < 10.0 if ankle else slope < 5.0 or (slope < 10.0 and number == 0)
        found = {
            'id': f'{number} {slope} {ankle} {hip}',
            HIP: hip,
            'verdict': 'walked' if up else 'fell',
            'stayed_up': up,
            VIBRATION: 0.1 + hip / 100 if up else None,
            SLIP: 0.01 - hip / 10_000 if up else None,
        }
        rows.append(row_of(slope, ankle, 'smooth', number) | found)
    with Folder(tmp_path / 'sweep', request(axes)) as folder:
        folder.append(rows)
        folder.export()
    return read_results(tmp_path / 'sweep')


AXES = {HIP: [12.0, 0.0], X: [20.0, 4.0, 8.0], Y: [0.0, 12.0]}


def test_names_the_gains_that_hold_each_slope_with_their_cost(tmp_path):
    flat, middle, steep = slope_gains(results(tmp_path, AXES))
    assert [each.condition[X] for each in (flat, middle, steep)] == [4.0, 8.0, 20.0]
    assert flat.smallest[Y] == 0.0 and middle.smallest[Y] == 12.0
    assert len(middle.holding) == 2  # one seed without control is not enough
    assert middle.least(VIBRATION)[HIP] == 0.0 and middle.least(SLIP)[HIP] == 12.0
    assert steep.smallest is None and steep.least(SLIP) is None
    lines = gains_page([flat, middle, steep]).splitlines()
    assert '| 8 | 2 of 4 | K_A 12, K_H 0: 5.7 deg/s, 10.0 mm |' in lines[3]
    assert '| 20 | 0 of 4 | - | - | - |' in lines[4]
    assert f'pitch rate above {MonitorParameters.vibration_frequency:g} Hz' in lines[-1]


def test_writes_the_table_and_all_tried_gains(tmp_path):
    path, data = write_gains(slope_gains(results(tmp_path, AXES)), tmp_path / 'new' / 'gains.md')
    assert path.read_text().startswith('| inclination, deg |')
    with data.open(encoding='utf-8') as file:
        assert len(list(csv.DictReader(file))) == 12


def test_every_condition_has_a_column_of_its_own():
    names = ['scenario', 'case', 'gyro.noise', 'foot_force.noise', MU]
    slope = Slope(
        dict.fromkeys(names, 1) | {X: 4.0},
        pd.DataFrame([{'runs': 1, 'up': 0, VIBRATION: None, SLIP: None}]),
    )
    head = gains_page([slope]).splitlines()[0]
    assert head.startswith(
        '| scenario | case | gyro.noise | foot_force.noise | friction | inclination, deg |'
    )


@pytest.mark.parametrize(
    'axes', [{X: [4.0]}, {**AXES, 'simulator.friction': {'low': 0.0, 'high': 1.0}}]
)
def test_refuses_a_sweep_without_a_grid_of_slopes_and_gains(axes, tmp_path):
    with pytest.raises(KhrError, match=r'accepted: a grid of simulator\.inclination_deg and'):
        slope_gains(results(tmp_path, axes))


# ---- shares and best gains ----


@given(
    st.integers(1, 6),
    st.integers(1, 30),
    st.floats(-20.0, 20.0),
    st.floats(0.1, 5.0),
    st.booleans(),
)
@settings(max_examples=30)
def test_a_clean_step_is_crossed_in_its_middle(before, runs, start, step, falling):
    x = start + step * np.arange(8)
    hits = runs * ((np.arange(8) < before) == falling)
    found = crossing(x, hits.astype(float), np.full(8, float(runs)))
    assert found.value == pytest.approx(start + step * (before - 0.5), abs=0.1 * step)
    assert found.low < found.value < found.high
    if runs >= 4:
        assert x[before - 1] - 0.2 * step < found.low
        assert found.high < x[before] + 0.2 * step


@given(st.integers(2, 40))
@settings(max_examples=10)
def test_survival_everywhere_and_nowhere_leave_a_side_open(runs):
    x, all_runs = np.arange(5.0), np.full(5, float(runs))
    above = crossing(x, all_runs, all_runs)
    assert math.isnan(above.value) and above.high == math.inf and above.low > 2.5
    below = crossing(x, 0.0 * x, all_runs)
    assert math.isnan(below.value) and below.low == -math.inf and below.high < 1.5
    one = crossing(x[:1], all_runs[:1] / 2.0, all_runs[:1])
    assert math.isnan(one.value) and (one.low, one.high) == (-math.inf, math.inf)


def test_the_interval_holds_the_truth_as_often_as_it_claims():
    generator = np.random.default_rng(5)
    x, runs, held, errors = np.arange(0.0, 12.5), np.full(13, 8.0), 0, []
    for _ in range(60):
        truth = generator.uniform(3.0, 9.0)
        found = crossing(x, generator.binomial(8, 1 / (1 + np.exp((x - truth) / 0.8))), runs)
        held += found.low <= truth <= found.high
        errors.append(found.value - truth)
    assert held >= 52  # of 57 expected: three standard deviations less
    assert abs(np.mean(errors)) < 3 * np.std(errors) / np.sqrt(60)


CELL = {'x': 5.0, 'y': 12.0, 'runs': 3, 'up': 3, 'slipped': 0, 'vibration_rad_s': 0.1}


def run(x, y, verdict, vibration=0.1, slip=0.01, axis=Y):
    return {X: x, axis: y, 'fell_at_s': None, **outcome(verdict, slip, vibration)}


def best(*cells):
    return best_cells(pd.DataFrame(cells), 'x')[['x', 'y']].to_numpy().tolist()


@pytest.mark.parametrize(
    'worse',
    [
        {'up': 2, 'vibration_rad_s': 0.01},
        {'slipped': 1, 'vibration_rad_s': 0.01},
        {'vibration_rad_s': 0.11},
        {'runs': 6, 'up': 5},
    ],
)
@pytest.mark.parametrize('order', [1, -1])
def test_staying_up_comes_before_slipping_and_that_before_vibration(worse, order):
    assert best(*[CELL, {**CELL, 'y': 18.0, **worse}][::order]) == [[5.0, 12.0]]


def test_best_gains_name_where_nothing_helps():
    runs = run_table(
        [
            run(5.0, 12.0, 'walked'),
            run(5.0, 18.0, 'walked', 0.2),
            run(7.0, 12.0, 'fell'),
            run(7.0, 18.0, 'slipped', 0.2),
            run(9.0, 12.0, 'fell'),
            run(9.0, 18.0, 'fell', 0.2),
        ]
    )
    found = map_result(runs, Y)
    assert found.name == Y and found.hopeless_deg == (9.0,)
    assert [(cell[X], cell[Y]) for cell in found.best] == [(5.0, 12.0), (7.0, 18.0)]
    bisected = map_result(runs, Y, bisected=True)
    assert not bisected.best and [limit['value'] for limit in bisected.limits] == [12.0, 18.0]


def test_rubber_and_smooth_are_tallied_for_each_inclination():
    runs = run_table(
        run(x, y, 'fell' if x > limit else 'walked', vibration, slip, MU)
        for x in (4.0, 6.0, 8.0)
        for _ in range(3)
        for y, limit, vibration, slip in ((SMOOTH, 7.0, 0.1, 0.02), (RUBBER, 5.0, 0.2, 0.001))
    )
    found = map_result(runs, MU)
    assert [row[X] for row in found.soles] == [4.0, 6.0, 8.0]
    assert [row['up_smooth'] for row in found.soles] == [3, 3, 0]
    assert [row['up_rubber'] for row in found.soles] == [3, 0, 0]
    assert found.soles[1]['largest_slip_m_smooth'] == 0.02
    assert found.soles[1]['largest_slip_m_rubber'] is None, 'all fell'
    limits = {limit['value']: limit['deg'] for limit in found.limits}
    assert limits == pytest.approx({SMOOTH: 7.0, RUBBER: 5.0}, abs=0.2)
    smooth = runs[runs[MU] == SMOOTH]
    assert map_result(smooth, MU).soles[0]['runs_rubber'] is None
    assert len(tally(smooth, [X])) == 3


def test_the_map_of_friction_holds_both_soles():
    """The table has columns for them: a map without them would leave them empty."""
    tried = specification_of('map_walk_mu', False).axes[MU].values
    assert {SMOOTH, RUBBER} <= set(tried)
