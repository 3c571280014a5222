"""The documents as pages: ``make site`` runs Sphinx over the Markdown, as it lies here."""

from pathlib import Path

project = 'khr'
html_title = 'khr: balance of the KHR-3HV'
extensions = ['myst_parser', 'sphinx.ext.autodoc', 'sphinx.ext.napoleon', 'sphinxcontrib.mermaid']
include_patterns = ['README.md', 'CONTRIBUTING.md', 'CHANGELOG.md', 'docs/*.md', 'docs/api.rst']
root_doc = 'README'
myst_fence_as_directive = ['mermaid']
myst_heading_anchors = 3
html_theme = 'furo'
html_static_path, html_css_files = ['style'], ['site.css']
html_show_copyright = html_show_sphinx = False
autodoc_typehints = 'description'

# The order of the pages, in the margin of each; docs/index.md says what they hold.
CONTENTS = """

```{toctree}
:hidden:
:glob:

docs/tutorial
docs/view
docs/tuning
docs/api
docs/architecture
docs/nodes
docs/interfaces
docs/extending
docs/*
CONTRIBUTING
CHANGELOG
```
"""


def add_contents(app, name, source):
    """Put the contents under the README, whose Markdown is read elsewhere too."""
    if name == root_doc:
        source[0] += CONTENTS


def add_entrance(app, error):
    """Let the folder open with the README."""
    if error is None:
        page = '<!doctype html><meta http-equiv="refresh" content="0; url=README.html">\n'
        Path(app.outdir, 'index.html').write_text(page, encoding='utf-8')


def setup(app):
    """Connect what is done besides."""
    app.connect('source-read', add_contents)
    app.connect('build-finished', add_entrance)
