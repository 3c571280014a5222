"""The environment that makes results independent of the processor reaches every process."""

import os
import subprocess
import sys

import pytest

from khr_common import arithmetic
from khr_common.arithmetic import CHOICE, NATIVE, NO_FMA, PORTABLE, SETTINGS, TUNABLES
from tests import ROOT

IN_FORCE = 'from khr_common.arithmetic import in_force; print(in_force())'


def started(*command, timeout=None, **own):
    """Return what a process prints that is started without the settings."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in (*SETTINGS, '_ROS_WHEELS_BOOTSTRAP_COMPLETE')
    }
    return subprocess.run(
        command, env=kept | own, capture_output=True, text=True, check=True, timeout=timeout
    ).stdout.strip()


def test_a_script_is_started_in_portable_arithmetic():
    assert started(sys.executable, '-m', 'khr_common.arithmetic', '-c', IN_FORCE) == PORTABLE


def test_other_programs_of_the_environment_are_left_alone():
    code = 'import os; print(os.environ.get("OPENBLAS_CORETYPE"))'
    assert started(sys.executable, '-c', code) == 'None'


def test_whoever_asks_for_it_has_the_processor_s_own_and_is_told():
    native = {CHOICE: NATIVE}
    code = f'{IN_FORCE}; from khr_common.arithmetic import warning; print(warning())'
    found, told = started(sys.executable, '-c', code, **native).splitlines()
    if found == PORTABLE:
        pytest.skip('this processor has no other arithmetic')
    assert found.startswith(NATIVE)
    assert told.startswith(f'arithmetic is {found}') and CHOICE in told


def test_an_entry_point_starts_its_program_anew_where_nothing_did_before():
    code = f'from khr_common.arithmetic import enter; enter(); {IN_FORCE}'
    path = os.pathsep.join(sys.path)
    assert started(sys.executable, '-S', '-c', code, PYTHONPATH=path) == PORTABLE


def test_an_entry_point_starts_anew_once_where_python_itself_sets_a_variable(tmp_path):
    (tmp_path / 'sitecustomize.py').write_text(
        'import os\nos.environ["OPENBLAS_NUM_THREADS"] = "8"\n'
    )
    code = 'from khr_common.arithmetic import enter; enter(); import os; print(sorted(os.environ))'
    path = os.pathsep.join([str(tmp_path), *sys.path])
    names = started(sys.executable, '-c', code, PYTHONPATH=path, timeout=20)
    assert 'OPENBLAS_CORETYPE' in names and '_ENTERED' not in names


@pytest.mark.parametrize('tunables', ['glibc.malloc.arena_max=2', NO_FMA])
def test_a_kernel_set_before_is_overridden_and_other_tunables_are_kept(monkeypatch, tunables):
    for name, value in {**SETTINGS, 'OPENBLAS_CORETYPE': 'Haswell', TUNABLES: tunables}.items():
        monkeypatch.setenv(name, value)
    expected = {'OPENBLAS_CORETYPE': 'Nehalem'}
    if tunables != NO_FMA:
        expected[TUNABLES] = f'{tunables}:{NO_FMA}'
    assert arithmetic._missing() == expected


def test_a_sourced_workspace_has_the_same_settings():
    lines = (ROOT / 'src/khr_common/hook/arithmetic.dsv').read_text().splitlines()
    kinds, names, values = zip(*(line.split(';') for line in lines), strict=True)
    assert dict(zip(names, values, strict=True)) == SETTINGS
    overrides = {'GLIBC_TUNABLES': 'set-if-unset'}  # other tunables stay
    assert dict(zip(names, kinds, strict=True)) == {n: overrides.get(n, 'set') for n in names}
