"""A first walk: does it hold, and what does the torso's pitch rate sound like?

python examples/first_walk.py [--out first_walk.png]
"""

import argparse

import matplotlib.pyplot as plt
import numpy as np

import khr

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument('--out', default='first_walk.png', help='the picture')
out = parser.parse_args().out

figure, (rates, spectra) = plt.subplots(2, figsize=(8, 6), layout='constrained')
for gain in (0.0, 12.0):
    walk = khr.run(
        'walk_3deg', set={'ankle_controller.enabled': gain > 0, 'ankle_controller.gain': gain}
    )
    spectrum = khr.spectrum(walk)
    label = f'K_A = {gain:g}'
    print(f'{label}: {walk.outcome.verdict}, {walk.outcome.distance:.3f} m')
    for peak in spectrum.peaks[:3]:
        print(f'    {peak.frequency:5.2f} Hz  {np.degrees(peak.amplitude):5.2f} deg/s')
    rates.plot(walk.signals.time, np.degrees(walk.signals.gyro_rate), label=label, linewidth=0.8)
    spectra.plot(spectrum.frequency, np.degrees(spectrum.amplitude), label=label, linewidth=0.8)
rates.set(xlabel='time (s)', ylabel='pitch rate, gyro (deg/s)')
spectra.set(xlabel='frequency (Hz)', ylabel='amplitude (deg/s)', xlim=(0, 15))
spectra.legend()
figure.savefig(out)
print(out)
