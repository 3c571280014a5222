"""A sweep and its map: where does the walk hold, by inclination and ankle gain?

python examples/sweep_map.py [--out sweep_map.png] [--workers 2]
"""

import argparse

import matplotlib.pyplot as plt
import numpy as np

import khr

SLOPES, GAINS = [4.0, 6.0, 8.0, 10.0], [0.0, 12.0, 24.0]  # deg, board units


def main():
    """Run the sweep and draw its map."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--out', default='sweep_map.png', help='the picture')
    parser.add_argument('--workers', type=int, default=2, help='processes')
    options = parser.parse_args()

    table = khr.sweep(
        'walk_7.68deg_ka12',
        {'simulator.inclination_deg': SLOPES, 'ankle_controller.gain': GAINS},
        set={'simulator.engine': 'mujoco'},  # three times as fast
        workers=options.workers,
    )
    held = np.zeros((len(GAINS), len(SLOPES)))
    for row in table.to_pylist():
        place = (
            GAINS.index(row['ankle_controller.gain']),
            SLOPES.index(row['simulator.inclination_deg']),
        )
        held[place] = row['stayed_up']

    figure, axes = plt.subplots(figsize=(6, 3.5), layout='constrained')
    axes.imshow(held, cmap='cividis', vmin=0, vmax=1, aspect='auto', origin='lower')
    axes.set_xticks(range(len(SLOPES)), [f'{slope:g}' for slope in SLOPES])
    axes.set_yticks(range(len(GAINS)), [f'{gain:g}' for gain in GAINS])
    axes.set(xlabel='inclination (deg)', ylabel='ankle gain K_A', title='Yellow: the walk holds')
    figure.savefig(options.out)
    print(options.out)


if __name__ == '__main__':
    main()
