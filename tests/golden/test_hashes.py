"""One trajectory on every machine: kept hashes, on this processor and on emulated ones."""

import os
import shutil
import subprocess
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor

import pytest

from khr_common.arithmetic import CHOICE, NATIVE, PORTABLE, SETTINGS, in_force
from tests import ROOT
from tests.golden import BOUTS, EMULATED, ENGINES, SCENARIOS, expected, key, measure, measure_bout

# MuJoCo's wheel needs AVX, which the first has not.
PROCESSORS = {'Nehalem': ('bullet',), 'Haswell': ENGINES}
EMULATOR = shutil.which('qemu-x86_64')


@pytest.fixture(autouse=True)
def portable():
    assert in_force() == PORTABLE, 'start pytest from the top folder of the repository'


@pytest.mark.parametrize('engine', ENGINES)
@pytest.mark.parametrize('scenario', SCENARIOS)
def test_a_scenario_takes_the_kept_trajectory(scenario, engine):
    seconds = SCENARIOS[scenario]
    kept = expected()[key(scenario, seconds, engine)]
    assert measure(scenario, engine, seconds) == kept, 'python -m tests.golden --write renews it'


@pytest.mark.parametrize('engine', ENGINES)
@pytest.mark.parametrize('bout', BOUTS)
def test_a_bout_takes_the_kept_trajectory(bout, engine):
    seconds = BOUTS[bout]
    kept = expected()[key(bout, seconds, engine)]
    assert measure_bout(bout, engine, seconds) == kept, 'python -m tests.golden --write renews it'


def short(*command, engines=ENGINES, **environment):
    """Return the hashes of the emulated runs, from a process of its own."""
    ended = subprocess.run(
        [*command, '-m', 'tests.golden', '--short', *engines],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.split()


def kept_short(engines=ENGINES):
    return [expected()[key(*EMULATED, engine)] for engine in engines]


@pytest.mark.slow
def test_another_kernel_of_the_linear_algebra_library_changes_nothing():
    """The oldest one, which every processor has."""
    environment = {**SETTINGS, 'OPENBLAS_CORETYPE': 'Prescott', CHOICE: NATIVE}
    assert short(sys.executable, **environment) == kept_short()


@pytest.mark.nightly
@pytest.mark.timeout(600)
@pytest.mark.skipif(not EMULATOR, reason='no qemu-x86_64 (Debian: qemu-user): nothing emulated')
def test_emulated_processors_take_the_kept_trajectory(tmp_path):
    """Without site: the .pth file of the ROS wheels restarts Python outside the emulator."""
    base = sys._base_executable
    path = os.pathsep.join([os.environ.get('PYTHONPATH', ''), sysconfig.get_paths()['purelib']])
    own = {'PYTHONPATH': path.strip(os.pathsep), 'NUMBA_CACHE_DIR': str(tmp_path), **SETTINGS}

    def emulated(processor, engines):
        return short(EMULATOR, '-cpu', processor, base, '-S', engines=engines, **own)

    with ThreadPoolExecutor() as pool:
        found = list(pool.map(emulated, PROCESSORS, PROCESSORS.values()))
    assert found == [kept_short(engines) for engines in PROCESSORS.values()]
