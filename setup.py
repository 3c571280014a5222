"""One distribution of all packages of src: what each of them holds, its own setup.py says."""

import os
from pathlib import Path

from setuptools import setup  # before distutils, which it brings

from distutils.core import run_setup  # isort: skip

HERE = Path(__file__).resolve().parent


def described(folder):  # noqa: ANN001, ANN201
    """Return what the setup.py of a package says, without building it."""
    os.chdir(folder)
    try:
        return run_setup('setup.py', stop_after='init')
    finally:
        os.chdir(HERE)


parts = [described(path.parent) for path in sorted(HERE.glob('src/*/setup.py'))]
entry_points = {}
for part in parts:
    for group, lines in (part.entry_points or {}).items():
        entry_points.setdefault(group, []).extend(lines)
setup(
    packages=[package for part in parts for package in part.packages],
    package_dir={part.get_name(): f'src/{part.get_name()}/{part.get_name()}' for part in parts},
    package_data={'': sorted({name for part in parts for name in part.package_data['']})},
    include_package_data=False,  # what package_data names, and no more
    entry_points=entry_points,
)
