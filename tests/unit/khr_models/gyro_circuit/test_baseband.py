import cmath
import dataclasses
import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from khr_common.errors import KhrError
from khr_models.gyro_circuit.baseband import Baseband
from khr_models.gyro_circuit.circuit import KRG4, TABLE_III
from khr_models.gyro_circuit.report import disagreement

PERIOD = 0.015
circuits = st.builds(
    lambda bandwidth, stiffness: dataclasses.replace(
        TABLE_III, bandwidth=bandwidth, sense_stiffness=stiffness
    ),
    st.floats(0.5, 1000.0),
    st.floats(0.05, 0.3),
)
rates = st.floats(-20.0, 20.0)
DECAY = KRG4.sense_damping / (2.0 * KRG4.mass)
MATCHED = dataclasses.replace(  # the sense axis rings at the carrier and decays as the RC does
    KRG4, sense_stiffness=KRG4.mass * (KRG4.carrier**2 + DECAY**2), bandwidth=DECAY / math.tau
)


@pytest.mark.parametrize('frequency', [0.0, 5.0, 50.0])
@pytest.mark.parametrize(('sample_period', 'held'), [(PERIOD, True), (0.001, False)])
def test_both_levels_agree_within_one_percent(frequency, sample_period, held):
    assert disagreement(frequency, sample_period, held=held) < 0.01


def test_a_node_need_not_load_scipy():
    code = (
        'import sys, khr_models.gyro_circuit.baseband as _; '
        'sys.exit(any(name.startswith("scipy") for name in sys.modules))'
    )
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == 0


@settings(max_examples=40)
@example(MATCHED, 0.001, [1.0, 1.0])
@example(dataclasses.replace(MATCHED, bandwidth=MATCHED.bandwidth * (1.0 + 1e-14)), 0.001, [1.0])
@given(circuits, st.floats(1e-5, 0.02), st.lists(rates, min_size=1, max_size=8))
def test_update_is_the_matrix_exponential_of_the_averaged_equations(circuit, period, inputs):
    """The envelope's equations, from m z'' + b z' + k z = F with z = Re(Z exp(j w_d t))."""
    m, b, k, w = circuit.mass, circuit.sense_damping, circuit.sense_stiffness, circuit.carrier
    phase = cmath.exp(-1j * circuit.reference_phase)
    static = abs(circuit.sense.response(1j * w))
    # Z'' = (rate - (b + 2j w m) Z' - (k - m w^2 + j w b) Z)/m, as (Z, Z', y, rate) in reals.
    complex_part = np.array([[0, 1], [-(k - m * w * w + 1j * w * b) / m, -(b + 2j * w * m) / m]])
    matrix = np.zeros((6, 6))
    matrix[0:4, 0:4] = np.kron(complex_part.real, np.eye(2)) + np.kron(
        complex_part.imag, [[0, -1], [1, 0]]
    )
    matrix[2, 5] = 1.0 / m
    corner = 1.0 / circuit.time_constant
    matrix[4, 0:2] = corner * np.array([phase.real, -phase.imag]) / static
    matrix[4, 4] = -corner
    # Scaled to Z in units of the static stretch and Z' of w times that.
    scale = np.diag([static, static, static * w, static * w, 1.0, 1.0])
    carry = expm(np.linalg.solve(scale, matrix @ scale) * period)
    state = np.zeros(6)
    baseband = Baseband(period, circuit)
    for rate in inputs:
        state[5] = rate
        state = carry @ state
        assert baseband.update(rate) == pytest.approx(state[4], rel=1e-6, abs=1e-6)


def test_a_changed_bandwidth_keeps_the_state():
    baseband = Baseband(PERIOD)
    for _ in range(100):
        baseband.update(1.0)
    baseband.configure(dataclasses.replace(KRG4, bandwidth=2.0))
    assert baseband.update(1.0) == pytest.approx(1.0, abs=1e-9)
    slow = baseband.update(0.0)
    assert slow == pytest.approx(math.exp(-math.tau * 2.0 * PERIOD), abs=1e-3)


def test_a_bad_period_or_rate_is_refused_and_leaves_the_state():
    with pytest.raises(KhrError, match=r'^sample_period: .*accepted: \(0, inf\) s'):
        Baseband(0.0)
    baseband = Baseband(PERIOD)
    with pytest.raises(KhrError, match=r'^rate: .*accepted: \(-inf, inf\)'):
        baseband.update(math.nan)
    assert baseband.update(0.0) == 0.0
