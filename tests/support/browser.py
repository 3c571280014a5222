"""A real browser without a screen, which finds no other host, and viewers without a browser."""

import re
import shutil
import socket
import threading
from contextlib import contextmanager, suppress
from pathlib import Path

import msgspec
import pytest
import viser
from playwright.sync_api import TimeoutError, sync_playwright
from viser._messages import ViewerCameraMessage
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from tests.support.runs import start_khr, wait_for, wait_until_running

CHROMIUM = shutil.which('chromium') or shutil.which('chromium-browser')
ARGUMENTS = [
    '--no-sandbox',
    '--enable-unsafe-swiftshader',
    '--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1',
]
PATIENCE = 60_000  # ms: it draws in software
# It draws in software, and a few frames a second show as much to a test.
FRAMES = """
    const next = window.requestAnimationFrame;
    window.requestAnimationFrame = draw => setTimeout(() => next(draw), 200);
    window.cancelAnimationFrame = clearTimeout;
"""
# Keep the words of the page in the order in which they come, also those that do not stay.
WORDS = """
    window.said = [];
    new MutationObserver(() => {
        for (const place of ['#khr-word', '.khr-state']) {
            const text = document.querySelector(place)?.textContent;
            if (text && text !== window.said.at(-1)) window.said.push(text);
        }
    }).observe(document, {childList: true, subtree: true, characterData: true});
"""


@contextmanager
def browser_page(width=1000, height=500):  # a small picture is drawn sooner
    """Yield a page, and the addresses of all that it asks the network for."""
    if CHROMIUM is None:
        pytest.skip('no Chromium on this machine: apt-get install chromium')
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        page = browser.new_page(viewport={'width': width, 'height': height})
        page.set_default_timeout(PATIENCE)
        page.add_init_script(FRAMES + WORDS)
        asked = []
        page.on('request', lambda request: asked.append(request.url))
        page.on('websocket', lambda opened: asked.append(opened.url))
        yield page, asked
        browser.close()


def slider(page, label):
    """Return the thumb of a slider, by the label before it."""
    return row(page, label, '*[@role="slider"]').get_by_role('slider')


def row(page, label, holds):
    """Return the row of a control: what holds its label and one of these elements."""
    return page.locator(f'xpath=//label[.="{label}"]/ancestor::*[.//{holds}][1]')


def choose(page, label, option):
    """Choose an option of a dropdown."""
    row(page, label, 'input').locator('input').first.click()
    page.get_by_role('option', name=option, exact=True).click()


def said(page, words, since=''):
    """Wait until the page has said these words of its state, after others; patterns."""

    def found():
        texts = page.evaluate('window.said')
        first = next((n for n, text in enumerate(texts) if re.search(since, text)), len(texts))
        return any(re.search(words, text) for text in texts[first:])

    wait_for(lambda: page.wait_for_timeout(50) or found(), words)


def labels(page):
    """Return the labels of the controls that are there."""
    return [each.inner_text() for each in page.locator('label').all() if each.is_visible()]


def saved(page, name):
    """Click what saves a file, and return the file's name and content.

    A click while the page is drawn anew may be lost, as a reader's: then it is clicked once more.
    """

    def attempt(patience):
        with page.expect_download(timeout=patience) as download:
            page.get_by_text(name, exact=True).click()
        return download.value

    try:
        file = attempt(PATIENCE / 4)
    except TimeoutError:
        file = attempt(PATIENCE)
    return file.suggested_filename, Path(file.path()).read_bytes()


def chart(page, title):
    """Return a chart by how its title begins."""
    return page.locator('.uplot', has=page.locator('.u-title', has_text=re.compile(f'^{title}')))


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


@contextmanager
def viewed_run(folder, *arguments):
    """Yield the process of a live page once its run goes on: with its folder, port and domain."""
    port = free_port()
    process = start_khr('view', *arguments, '--no-browser', '--port', port, '--out', folder)
    process.folder, process.port = folder, port
    try:
        process.domain = wait_until_running(folder)
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
            process.communicate(timeout=60)


@contextmanager
def connected(port):
    """Yield the connection of a viewer that looks at a page as a browser does."""
    camera = ViewerCameraMessage(
        (1.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 1.0, 0.1, 10.0, 600, 800, (0.0,) * 3, (0, 0, 1)
    )
    with connect(
        f'ws://127.0.0.1:{port}',
        origin=f'http://127.0.0.1:{port}',
        subprotocols=[f'viser-v{viser.__version__}'],
        max_size=None,
        open_timeout=60,
        close_timeout=0.5,
    ) as connection:
        connection.send(msgspec.msgpack.encode(camera.as_serializable_dict([])))
        yield connection


@contextmanager
def viewer(port, reads=True):
    """Look at a page, and read what it sends, or nothing at all any more."""
    got = []

    def read(connection):
        with suppress(ConnectionClosed):
            for message in connection:
                got.append(len(message))

    with connected(port) as connection:
        if reads:
            threading.Thread(target=read, args=(connection,), daemon=True).start()
        yield got
