"""Rules for the sources that no linter checks."""

import ast
from collections import defaultdict

import pytest

from tests import ROOT

PACKAGES = sorted(path for path in (ROOT / 'src').glob('khr*') if (path / 'setup.py').is_file())
LARGEST = 5000  # lines of a package


def sources(package):
    return sorted(package.rglob('*.py'))


@pytest.mark.parametrize('package', PACKAGES, ids=lambda path: path.name)
def test_a_package_stays_small(package):
    assert sum(len(path.read_text().splitlines()) for path in sources(package)) <= LARGEST


def test_no_two_classes_share_a_name():
    places = defaultdict(list)
    for path in (path for package in PACKAGES for path in sources(package)):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith('_'):
                places[node.name].append(str(path.relative_to(ROOT)))
    assert len(places) > 100
    assert {name: files for name, files in places.items() if len(files) > 1} == {}
