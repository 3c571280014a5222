import csv

import pytest

from khr_common.errors import KhrError
from khr_studies.stability_map.slopes import SLIP, VIBRATION, page, slope_gains, write
from khr_sweeps.results.folder import Folder, read_results
from khr_sweeps.trial import RESULTS

INCLINATION, ANKLE, HIP = (
    'simulator.inclination_deg',
    'ankle_controller.gain',
    'hip_controller.gain',
)


def results(tmp_path, axes):
    """Return runs in which K_A 12 holds 8 deg, and no gain 20 deg; K_H costs vibration."""
    rows = []
    for number in range(2):
        for slope in axes[INCLINATION]:
            for ankle in axes.get(ANKLE, [0.0]):
                for hip in axes.get(HIP, [0.0]):
                    up = slope < 10.0 if ankle else slope < 5.0 or (slope < 10.0 and number == 0)
                    rows.append(
                        {
                            'id': f'{number} {slope} {ankle} {hip}',
                            INCLINATION: slope,
                            ANKLE: ankle,
                            HIP: hip,
                            'seed': number,
                            **dict.fromkeys(RESULTS),
                            'verdict': 'walked' if up else 'fell',
                            'stayed_up': up,
                            VIBRATION: 0.1 + hip / 100 if up else None,
                            SLIP: 0.01 - hip / 10_000 if up else None,
                        }
                    )
    request = {
        'version': 'v',
        'scenario': {'walk_3deg': {}},
        'cases': {},
        'axes': axes,
        'samples': None,
        'seeds': 2,
    }
    with Folder(tmp_path / 'sweep', request) as folder:
        folder.append(rows)
        folder.export()
    return read_results(tmp_path / 'sweep')


AXES = {HIP: [12.0, 0.0], INCLINATION: [20.0, 4.0, 8.0], ANKLE: [0.0, 12.0]}


def test_names_the_gains_that_hold_each_slope_with_their_cost(tmp_path):
    flat, middle, steep = slope_gains(results(tmp_path, AXES))
    assert [each.condition[INCLINATION] for each in (flat, middle, steep)] == [4.0, 8.0, 20.0]
    assert flat.smallest[ANKLE] == 0.0 and middle.smallest[ANKLE] == 12.0
    assert len(middle.holding) == 2  # one seed without control is not enough
    assert middle.least(VIBRATION)[HIP] == 0.0 and middle.least(SLIP)[HIP] == 12.0
    assert steep.smallest is None and steep.least(SLIP) is None
    lines = page([flat, middle, steep]).splitlines()
    assert '| 8 | 2 of 4 | K_A 12, K_H 0: 5.7 deg/s, 10.0 mm |' in lines[3]
    assert '| 20 | 0 of 4 | - | - | - |' in lines[4]


def test_writes_the_table_and_all_tried_gains(tmp_path):
    path, data = write(slope_gains(results(tmp_path, AXES)), tmp_path / 'new' / 'gains.md')
    assert path.read_text().startswith('| inclination, deg |')
    with data.open(encoding='utf-8') as file:
        assert len(list(csv.DictReader(file))) == 12


@pytest.mark.parametrize(
    'axes', [{INCLINATION: [4.0]}, {**AXES, 'simulator.friction': {'low': 0.0, 'high': 1.0}}]
)
def test_refuses_a_sweep_without_a_grid_of_slopes_and_gains(axes, tmp_path):
    with pytest.raises(KhrError, match=r'accepted: a grid of simulator\.inclination_deg and'):
        slope_gains(results(tmp_path, axes))
