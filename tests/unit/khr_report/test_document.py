"""Documents as Markdown and as HTML."""

import sys

import pytest
from jinja2 import UndefinedError

from khr_report.page.document import bullets, grid, html, markdown, page_text, passage, verdict

DOCUMENT = [
    'A text with <b> and | in it.',
    passage('Title', [grid(['a', 'b'], [['x | y', verdict(False)], ['<z>', verdict(None)]])]),
    bullets(['one', 'two']),
]


def test_a_document_is_markdown():
    assert markdown(DOCUMENT).split('\n\n') == [
        'A text with <b> and | in it.',
        '## Title',
        '| a | b |\n| --- | --- |\n| x \\| y | **miss** |\n| <z> | no number published |',
        '- one\n- two',
    ]


def test_a_document_is_html_with_its_verdicts_coloured():
    text = str(html(DOCUMENT))
    assert '<p>A text with &lt;b&gt; and | in it.</p>' in text
    assert '<h3>Title</h3>' in text
    assert '<th scope="col">a</th>' in text and '<th scope="row">x | y</th>' in text
    assert '<td data-head="b" class="miss"><strong>miss</strong></td>' in text
    assert '<th scope="row">&lt;z&gt;</th>' in text
    assert '<td data-head="b" class="none">no number published</td>' in text
    assert '<li>one</li>' in text


def test_a_paragraph_s_marks_are_rendered_and_documents_are_named_not_linked():
    text = str(html(['Written by `khr x` of <b>, *fitted* ([page](page.md)); 2 * 3 * 4.']))
    assert text.strip() == (
        '<p>Written by <code>khr x</code> of &lt;b&gt;, <em>fitted</em> (page); 2 * 3 * 4.</p>'
    )


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
POINTS = bullets(['one', 'two'])
VALUES = {'share': 0.25, 'points': [POINTS, 'and'], 'rows': grid(['a'], [['| x']])}


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
