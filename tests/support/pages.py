"""Read an HTML page, and check that it stands alone."""

import re
from html.parser import HTMLParser


class Page(HTMLParser):
    """Sources, links, anchors, tags and words of a page."""

    def __init__(self, text):
        super().__init__()
        self.sources, self.links, self.names, self.tags, self.words = [], [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.tags.append(tag)
        self.sources += [found['src']] if 'src' in found else []
        self.links += [found['href']] if 'href' in found else []
        self.names += [found['id']] if 'id' in found else []

    def handle_data(self, data):
        self.words.append(data)

    @property
    def text(self):
        return ' '.join(' '.join(self.words).split())


def check_alone(path):
    """Check that a page needs nothing but itself and files beside it; return it."""
    text = path.read_text()
    page = Page(text)
    assert all(source.startswith('data:image/png;base64,') for source in page.sources)
    for link in page.links:
        if link.startswith('#'):
            assert page.names.count(link[1:]) == 1, link
        elif not link.startswith('data:text/csv;base64,'):
            assert (path.parent / link).is_file(), link
    assert len(page.names) == len(set(page.names))
    assert not {'script', 'link', 'iframe', 'object'} & set(page.tags)
    assert not re.search(r'url\(|@import|https?://', text)
    assert 'name="viewport"' in text and '@media print' in text
    return page
