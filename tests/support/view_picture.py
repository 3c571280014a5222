"""Draw docs/view.png, the page of a live run: ``python -m tests.support.view_picture [FILE]``."""

import re
import signal
import sys
import tempfile
from pathlib import Path

from tests import ROOT
from tests.support.browser import browser_page, free_port
from tests.support.runs import start_khr, wait_for

SCENARIO = 'walk_7.68deg_ka12'
SHOWN = 7.0  # s: the third gait cycle is over


def draw(file):
    """Start the run, look at it in a browser, and save what is seen once SHOWN has passed."""
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        run = start_khr(
            'view', SCENARIO, '--no-browser', '--port', port, '--out', Path(folder) / 'run'
        )
        try:
            next(line for line in run.stderr if 'page: http' in line)  # its door is open
            with browser_page(width=1280, height=800) as (page, _):
                page.goto(f'http://127.0.0.1:{port}/')
                page.get_by_role('button', name='Pause').wait_for()
                page.locator('.mantine-Notification-closeButton').first.click()  # no GPU: known
                wait_for(
                    lambda: page.wait_for_timeout(100) or _time(page) > SHOWN, 'the third cycle'
                )
                page.screenshot(path=file)
        finally:
            run.send_signal(signal.SIGINT)
            run.communicate(timeout=60)


def _time(page):
    rows = page.locator('.khr tr').all_inner_texts()
    found = re.search(r'time\s+([\d.]+) s', '\n'.join(rows))
    return float(found[1]) if found else 0.0


if __name__ == '__main__':
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / 'docs' / 'view.png')
