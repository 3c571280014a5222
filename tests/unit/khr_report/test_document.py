"""Documents as Markdown and as HTML."""

import pytest

from khr_report.page.document import Bullets, Passage, Table, Verdict, html, markdown
from khr_report.page.text import duration

DOCUMENT = [
    'A text with <b> and | in it.',
    Passage('Title', (Table(('a', 'b'), (('x | y', Verdict(False)), ('<z>', Verdict(None)))),)),
    Bullets(('one', 'two')),
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


@pytest.mark.parametrize(
    ('seconds', 'text'),
    [
        (12.4, '12 s'),
        (89.0, '89 s'),
        (150.0, '2 min'),
        (3600.0, '60 min'),
        (2 * 3600.0 + 300.0, '2 h 5 min'),
    ],
)
def test_durations(seconds, text):
    assert duration(seconds) == text
