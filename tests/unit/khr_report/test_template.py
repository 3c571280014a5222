"""Pages filled from templates."""

import sys

import pytest
from jinja2 import UndefinedError

from khr_report.page.document import Bullets, Table
from khr_report.page.template import page_text

TEMPLATE = """
Lead with {{ share | f('.0%') }}.

{{ points }}

## Title {{ number }}

{% if number > 1 %}
Left out below two.
{% endif %}

### Within

{{ rows }}

Last.
"""
POINTS = Bullets(('one', 'two'))
ROWS = Table(('a',), (('| x',),))
VALUES = {'share': 0.25, 'points': [POINTS, 'and'], 'rows': ROWS}


@pytest.fixture
def module(tmp_path, monkeypatch):
    package = tmp_path / 'paged'
    package.mkdir()
    (package / '__init__.py').touch()
    (package / 'page.md.j2').write_text(TEMPLATE)
    monkeypatch.syspath_prepend(tmp_path)
    yield 'paged.page'
    sys.modules.pop('paged', None)


@pytest.mark.parametrize('number', [1, 2])
def test_a_filled_template_is_a_document(module, number):
    below = ('Left out below two.',) * (number > 1)
    assert page_text(module, number=number, **VALUES).split('\n\n') == [
        'Lead with 25%.',
        '- one\n- two',
        'and',
        f'## Title {number}',
        *below,
        '### Within',
        '| a |\n| --- |\n| \\| x |',
        'Last.\n',
    ]


def test_a_value_that_is_missing_is_an_error(module):
    with pytest.raises(UndefinedError, match='number'):
        page_text(module, **VALUES)
