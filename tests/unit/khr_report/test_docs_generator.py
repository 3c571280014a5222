"""Defaults, parameters and the README's scenarios are what the parameter tables say."""

import pytest

from khr_report.docs_generator import generated
from tests import ROOT


@pytest.mark.parametrize(
    ('path', 'text'), generated(ROOT).items(), ids=lambda each: getattr(each, 'name', '')
)
def test_generated_document_is_current(path, text):
    assert path.read_text(encoding='utf-8') == text, 'run: make docs'
