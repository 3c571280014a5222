import dataclasses
import math
import shutil
import subprocess

import numpy as np
import pytest

from khr_common.errors import KhrError
from khr_models.gyro_circuit.carrier import simulate
from khr_models.gyro_circuit.circuit import KRG4, TABLE_III
from tests.support.gyro_netlist import VECTORS, netlist, sine

RATE = math.radians(300.0)
DURATION = 0.01
# Of each waveform's largest value. The two converge to each other: 100, 200, 400 and 800 steps
# of ngspice's trapezoidal rule per cycle leave 5.5e-3, 2.4e-3, 6e-4, 2e-4 in V_out after a step.
TOLERANCE = 1e-3

needs_ngspice = pytest.mark.skipif(
    shutil.which('ngspice') is None, reason='ngspice is not installed (Debian package ngspice)'
)


def run_ngspice(folder, rate, circuit):
    circuit_file, output = folder / 'gyro.cir', folder / 'waveforms.txt'
    circuit_file.write_text(netlist(rate, DURATION, 'waveforms.txt', circuit, steps_per_cycle=400))
    done = subprocess.run(
        ['ngspice', '-b', circuit_file.name],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert output.exists(), done.stdout + done.stderr
    table = np.loadtxt(output)
    return table[:, 0], dict(zip(VECTORS, table[:, 1:].T, strict=True))


@needs_ngspice
@pytest.mark.parametrize(
    ('expression', 'rate', 'circuit'),
    [
        (sine(RATE, 200.0), lambda t: RATE * np.sin(math.tau * 200.0 * t), KRG4),
        (repr(RATE), lambda t: np.full_like(t, RATE), KRG4),
        (
            sine(RATE, 200.0),
            lambda t: RATE * np.sin(math.tau * 200.0 * t),
            dataclasses.replace(TABLE_III, sense_stiffness=0.08, bandwidth=500.0),
        ),
    ],
    ids=['modulated', 'step from rest', 'nearly matched resonances'],
)
def test_waveforms_agree_with_ngspice(tmp_path, expression, rate, circuit):
    time, theirs = run_ngspice(tmp_path, expression, circuit)
    ours = simulate(rate, DURATION, circuit, steps_per_cycle=64)
    inside = (ours.time >= time[0]) & (ours.time <= time[-1])
    for name in VECTORS:
        mine = getattr(ours, name)[inside]
        other = np.interp(ours.time[inside], time, theirs[name])
        off = np.abs(mine - other).max() / np.abs(mine).max()
        assert off < TOLERANCE, f'{name}: {off:.1e} of its largest value'


@needs_ngspice
def test_ngspice_settles_to_the_packaged_sensitivity(tmp_path):
    fast = dataclasses.replace(KRG4, bandwidth=500.0)
    time, theirs = run_ngspice(tmp_path, repr(RATE), fast)
    late = time > 0.009
    mean = np.trapezoid(theirs['demodulated'][late], time[late]) / np.ptp(time[late])
    assert 1e3 * mean / 300.0 == pytest.approx(0.67, rel=0.005)


@pytest.mark.parametrize(
    ('arguments', 'name'),
    [({'duration': 0.0}, 'duration'), ({'steps_per_cycle': 0}, 'steps_per_cycle')],
)
def test_bad_input_is_refused(arguments, name):
    with pytest.raises(KhrError, match=rf'^{name}: '):
        netlist('1', **{'duration': 0.01, 'output': 'x', **arguments})
