"""The models' documents hold today's numbers, and name what exists."""

import importlib
import re

import pytest

import khr_models.gyro_circuit.report
import khr_models.report
from tests import ROOT

DOCUMENT = ROOT / 'docs' / 'models.md'


@pytest.mark.slow
@pytest.mark.parametrize('report', [khr_models.report, khr_models.gyro_circuit.report])
def test_the_document_is_up_to_date(report):
    text = (ROOT / report.PART.command.split()[-1]).read_text(encoding='utf-8')
    assert report.PART.rewrite(text) == text, f'run: python -m {report.PART.command}'


def test_the_document_names_only_what_exists():
    rows = re.findall(
        r'^\| (`[a-z_`., ]+) \|.*\| (.*) \|$', DOCUMENT.read_text(encoding='utf-8'), re.MULTILINE
    )
    assert len(rows) > 10
    for modules, contents in rows:
        loaded = [
            importlib.import_module(f'khr_models.{name}')
            for name in re.findall(r'`([\w.]+)`', modules)
        ]
        for name in re.findall(r'`(\w+)[`.]', contents):
            assert any(hasattr(module, name) for module in loaded), name
