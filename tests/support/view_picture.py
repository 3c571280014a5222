"""Draw docs/view.png and docs/bout_view.png, pages of live runs.

``python -m tests.support.view_picture [FOLDER]``
"""

import re
import signal
import sys
import tempfile
from pathlib import Path

from tests import ROOT
from tests.support.browser import browser_page, free_port
from tests.support.runs import start_khr, wait_for

SHOWN = {  # s of each run
    'view.png': ('walk_7.68deg_ka12', 7.0),  # the third gait cycle is over
    'bout_view.png': ('shove_guard', 4.5),  # in the second shove
}


def draw(file, run_of, shown):
    """Start a run, look at it in a browser, and save what is seen once its time has come."""
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        run = start_khr(
            'view', run_of, '--no-browser', '--port', port, '--out', Path(folder) / 'run'
        )
        try:
            next(line for line in run.stderr if 'page: http' in line)  # its door is open
            with browser_page(width=1280, height=800) as (page, _):
                page.goto(f'http://127.0.0.1:{port}/')
                page.get_by_role('button', name='Pause').wait_for()
                page.locator('.mantine-Notification-closeButton').first.click()  # no GPU: known
                wait_for(lambda: page.wait_for_timeout(100) or _time(page) > shown, 'the time')
                page.screenshot(path=file)
        finally:
            run.send_signal(signal.SIGINT)
            run.communicate(timeout=60)


def _time(page):
    rows = page.locator('.khr tr').all_inner_texts()
    found = re.search(r'time\s+([\d.]+) s', '\n'.join(rows))
    return float(found[1]) if found else 0.0


if __name__ == '__main__':
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / 'docs'
    for name, (each, time) in SHOWN.items():
        draw(folder / name, each, time)
