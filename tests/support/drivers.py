"""Drivers in the simulator's place, installed beside the packages of this environment."""

import os
import shutil
from pathlib import Path

from tests import ROOT

EXAMPLE = ROOT / 'examples' / 'khr_example_driver'
PENDULUM = 'khr_example_driver/pendulum'
ROUGH = 'khr_fake_drivers/rough_pendulum.py'  # see tests.fakes
PATIENT = 'khr_fake_drivers/patient_pendulum.py'


def install(prefix: Path, package: str, executable: Path) -> None:
    """Put an executable where ROS 2 looks for those of a package."""
    target = prefix / 'lib' / package / executable.name
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy2(executable, target)
    target.chmod(0o755)
    marker = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages' / package
    marker.parent.mkdir(parents=True, exist_ok=True)
    marker.touch()


def install_example(prefix: Path) -> dict[str, str]:
    """Install the example, and its relatives; return what the environment must have."""
    install(prefix, 'khr_example_driver', EXAMPLE / 'scripts' / 'pendulum')
    for fake in (ROUGH, PATIENT):
        package, name = fake.split('/')
        install(prefix, package, ROOT / 'tests' / 'fakes' / name)
    paths = [str(EXAMPLE), os.environ.get('PYTHONPATH', '')]
    return {'AMENT_PREFIX_PATH': str(prefix), 'PYTHONPATH': ':'.join(filter(None, paths))}
