import dataclasses
import math
import shutil
import subprocess

import numpy as np
import pytest

from khr_common.errors import KhrError
from khr_models.gyro_circuit.carrier import simulate, static_characteristic
from khr_models.gyro_circuit.circuit import KRG4, TABLE_III
from tests.support.gyro_netlist import VECTORS, netlist


def constant(rate):
    return lambda time: np.full_like(time, rate)


def test_static_characteristic_is_the_packaged_line():
    rates_deg = np.linspace(-300.0, 300.0, 7)
    millivolts = 1e3 * static_characteristic([math.radians(rate) for rate in rates_deg])
    assert np.abs(millivolts - 0.67 * rates_deg).max() < 0.005 * 0.67 * 300.0
    slope, offset = np.polyfit(rates_deg, millivolts, 1)
    assert slope == pytest.approx(0.67, rel=1e-6)
    assert offset == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize('steps_per_cycle', [5, 64])
def test_the_result_does_not_hang_on_the_step(steps_per_cycle):
    settled = static_characteristic([1.0], steps_per_cycle=steps_per_cycle)
    assert settled[0] == pytest.approx(KRG4.sensitivity, rel=1e-7)


@pytest.mark.parametrize('frequency', [5.0, 50.0])
def test_sinusoidal_rates_come_out_with_gain_and_phase_of_the_response(frequency):
    duration = 0.1 + 2.0 / frequency
    waveforms = simulate(lambda time: np.cos(math.tau * frequency * time), duration)
    late = waveforms.time > 0.1
    turn = np.exp(1j * math.tau * frequency * waveforms.time[late])
    measured = 2.0 * np.mean(waveforms.demodulated[late] / turn) / KRG4.sensitivity
    assert measured == pytest.approx(KRG4.response(frequency), abs=2e-3)


def test_ripple_is_what_the_circuit_says():
    waveforms = simulate(constant(1.0), 0.06, steps_per_cycle=64)
    settled = waveforms.demodulated[-640:] / KRG4.sensitivity
    assert np.ptp(settled) / 2.0 == pytest.approx(KRG4.ripple, rel=0.01)


def test_brownian_motion_walks_as_derived():
    circuit = dataclasses.replace(KRG4, bandwidth=1000.0)
    waveforms = simulate(constant(0.0), 20.0, circuit, steps_per_cycle=8, temperature=300.0)
    step = 128  # 16 cycles: the ripple averages out
    measured = waveforms.demodulated[:-1] / circuit.sensitivity
    rate = measured[: measured.size // step * step].reshape(-1, step).mean(axis=1)
    period = step / 8 / circuit.carrier_frequency
    size = 16  # 25 ms, far above the 0.16 ms of the RC
    means = np.convolve(rate, np.full(size, 1.0 / size), 'valid')
    allan_variance = (
        np.mean((means[size:] - means[:-size]) ** 2) / 2.0
    )  # overlapping, IEEE Std 952
    walk = math.sqrt(allan_variance * size * period)
    assert walk == pytest.approx(circuit.thermal_noise(300.0), rel=0.08)


def test_noise_is_repeatable_and_its_seed_matters():
    def run(seed):
        return simulate(constant(0.0), 0.001, temperature=300.0, seed=seed).demodulated

    np.testing.assert_array_equal(run(1), run(1))
    assert not np.array_equal(run(1), run(2))


@pytest.mark.parametrize(
    ('arguments', 'name'),
    [
        ({'duration': math.nan}, 'duration'),
        ({'temperature': -1.0}, 'temperature'),
        ({'rate': constant(math.nan)}, 'rate'),
        ({'steps_per_cycle': 4}, 'steps_per_cycle'),  # below the Nyquist rate
    ],
)
def test_bad_input_is_refused(arguments, name):
    with pytest.raises(KhrError, match=rf'^{name}: .*accepted: (integer in )?[(\[]'):
        simulate(**{'rate': constant(0.0), 'duration': 0.001, **arguments})


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
        (repr(RATE), constant(RATE), KRG4),
        (
            f'{RATE!r}*sin({math.tau * 200.0!r}*time)',
            lambda t: RATE * np.sin(math.tau * 200.0 * t),
            dataclasses.replace(TABLE_III, sense_stiffness=0.08, bandwidth=500.0),
        ),
    ],
    ids=['step from rest', 'modulated at nearly matched resonances'],
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
