"""``khr report BAG``: the page about a recording that is no run of khr."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from khr_analysis.peaks import Array
from khr_analysis.recorded_spectrum import RecordedSpectrum, recorded_spectrum
from khr_bringup.recorded.channel import Channel, read_channel, topics_in
from khr_common.errors import KhrError
from khr_report.output import csv_text
from khr_report.page.html import Section, data_uri, paragraphs, part, write_page
from khr_report.plots.plot_style import panels, save, styled

RESOLUTION = 150  # dots per inch
MOST_POINTS = 20_000  # of a plotted line


def report_recording(
    path: Path, out: Path, topic: str = '', axis: str = '', namespace: str = ''
) -> Path:
    """Write the page of a recording: its topics, one signal, and the spectrum of the signal.

    Args:
        path: the recording, or one of its files.
        out: the page to write; its path is returned.
        topic, axis, namespace: of the signal, as :func:`read_channel` takes them.
    """
    topics, notes = topics_in(path)
    channel = read_channel(path, topic, axis, namespace)
    rows = [(each.name, each.kind, str(each.messages)) for each in topics]
    sections = [
        Section('Topics', part('table', ('topic', 'type', 'messages'), rows, {})),
        *_signal(channel),
    ]
    name = path.resolve().name
    lead = paragraphs(f'Recording {name}: {channel.label}.') + part('notes', notes)
    return write_page(out, f'Recording {name}', lead, sections)


def _signal(channel: Channel) -> list[Section]:
    unit, label = channel.quantity.unit, channel.label.capitalize()
    try:
        found = recorded_spectrum(channel.even())
    except KhrError as error:
        return [Section('Signal', paragraphs(f'No spectrum: {error}.'))]
    samples = found.samples
    with styled():
        signal, (axis,) = panels(label, height=2.4)
        axis.plot(*_envelope(samples.times, samples.values), linewidth=0.8)
        axis.set(xlabel='time (s)', ylabel=unit)
        lines = _spectrum(found, unit)
    table = csv_text(
        ('time, s', f'{channel.label}, {unit}'), zip(samples.times, samples.values, strict=True), 9
    )
    link = Markup('<p><a download="signal.csv" href="{}">Signal (CSV)</a></p>').format(
        data_uri(table.encode(), 'text/csv')
    )
    peaks = [(f'{each.frequency:.3f}', f'{each.amplitude:.4g}') for each in found.spectrum.peaks]
    listed = part('table', ('frequency, Hz', f'amplitude, {unit}'), peaks, {})
    return [
        Section('Signal', picture(label, signal) + part('notes', found.notes) + link),
        Section(
            'Spectrum',
            picture('Amplitude over frequency', lines)
            + (listed if peaks else paragraphs('No line stands out of the noise.')),
        ),
    ]


def _envelope(times: Array, values: Array) -> tuple[Array, Array]:
    """Return the smallest and largest value of each group of samples, if there are too many.

    Every n-th sample alone would show a slow wave that is not there.
    """
    every = -(-2 * len(values) // MOST_POINTS)
    if every <= 2:
        return times, values
    groups = values[: len(values) // every * every].reshape(-1, every)
    ends = np.stack([groups.min(axis=1), groups.max(axis=1)], axis=1)
    return np.repeat(times[: groups.size : every], 2), ends.ravel()


def _spectrum(found: RecordedSpectrum, unit: str) -> Figure:
    figure, (axis,) = panels('', height=2.8)
    shown = found.spectrum
    every = max(1, len(shown.frequency) // MOST_POINTS)
    size = len(shown.frequency) // every * every
    highest = shown.amplitude[:size].reshape(-1, every).max(axis=1)
    axis.plot(shown.frequency[:size:every], highest, linewidth=0.8)
    for peak in shown.peaks:
        axis.annotate(
            f'{peak.frequency:.2f}', (peak.frequency, peak.amplitude), fontsize=7, ha='center'
        )
    axis.set(
        xlabel=f'frequency (Hz), up to {found.samples.highest:.4g} Hz',
        ylabel=f'amplitude ({unit})',
        ylim=(0.0, 1.1 * float(np.max(shown.amplitude))),
    )
    return figure


def picture(title: str, figure: Figure) -> Markup:
    """Return a figure as one of a page."""
    content = io.BytesIO()
    save(figure, content, dpi=RESOLUTION)
    return part('figure', '', title, data_uri(content.getvalue(), 'image/png'), None, '', '')
