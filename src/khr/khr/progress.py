"""The progress of a run as text."""

from __future__ import annotations

from khr_bringup.result import Progress
from khr_sweeps.progress import ProgressBar


def show_run(bar: ProgressBar, progress: Progress) -> None:
    """Show the progress of a run on a bar of simulated seconds."""
    words = [] if progress.factor is None else [f'x{progress.factor:.2f}']
    if progress.pitch_rate is not None:
        words.append(f'pitch rate {progress.pitch_rate:.3f} rad/s')
    if progress.peak:
        words.append(f'peak {progress.peak}')
    bar.show(progress.state, progress.time, text='  '.join(words))
