"""``khr film``: a run as MP4 and GIF, or one picture of it; two runs side by side."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from math import ceil
from pathlib import Path

import imageio_ffmpeg  # type: ignore[import-untyped]
import numpy as np
from PIL import Image

from khr_bringup.changes import Change
from khr_bringup.run_folder import of_robot
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_common.files import written
from khr_report.film.overlay import COLORS, Overlay
from khr_report.film.scene import Frame, Look, PosedScene, source_of
from khr_report.output import make_folder

GIF_COLORS = 96
FASTEST_GIF = 50.0  # pictures per second
SMOOTH = 1.5  # pictures are drawn so much larger, so that edges come out smooth
WIDEST = 1920  # px
Show = Callable[[str, float, float], None]


@dataclass(frozen=True, eq=False)
class Filmed:
    """A run to show: its scenario, all samples, and changes while it ran."""

    scenario: Scenario
    kept: Sequence[Frame]
    changes: Sequence[Change] = ()

    def at(self, time: float) -> Frame:
        """Return the sample at a time, s; the last one after the end."""
        index = bisect_left(self.kept, time - 1e-9, key=lambda frame: frame.time)
        return self.kept[min(index, len(self.kept) - 1)]


def render_run(
    run: str,
    out: Path | None = None,
    still: float | None = None,
    part: tuple[float, float | None] = (0.0, None),
    size: tuple[int, int, float] = (960, 720, 25.0),
    against: str | None = None,
    show: Show = lambda what, seconds, whole: None,
    namespace: str = '',
) -> list[Path]:
    """Render a run to MP4 and GIF, or one picture of it to PNG; return the files.

    Args:
        run: a run folder or bag, or a scenario file or name.
        out: path of the files, with or without a suffix; by default in the run folder, or the
            scenario's name in the current folder.
        still: time of the one picture, s.
        part: start and end of the film, s.
        size: width and height in px, pictures per s.
        against: another run, given as ``run``, on the right; each picture has ``size``.
        show: called with the name of the task, its progress and its total, s.
        namespace: of the robot, in a bag of several.

    Raises:
        KhrError: if an argument is not accepted or the files cannot be written.
        RunError: if a run does not repeat.
    """
    runs = [run] if against is None else [run, against]
    look = look_of(*size, panels=len(runs))
    chosen = [source_of(each, namespace) for each in runs]
    within(max(each.length for each in chosen), still, part)
    base = base_of(run, chosen[0].scenario.name, out, namespace)
    tracks = [
        Filmed(
            one.scenario, one.frames(part_of(f'repeating {each}', one.length, show)), one.changes
        )
        for one, each in zip(chosen, runs, strict=True)
    ]
    last = max(track.kept[-1].time for track in tracks)
    return render(base, last, lambda times: pictures(tracks, times, look), look, still, part, show)


def render(
    base: Path,
    last: float,
    draw: Callable[[Sequence[float]], Iterator[Image.Image]],
    look: Look,
    still: float | None,
    part: tuple[float, float | None],
    show: Show,
) -> list[Path]:
    """Write MP4 and GIF of pictures, or one to PNG; return the files.

    Args:
        base: the files without their suffixes.
        last: time of the last picture, s.
        draw: yields the picture at each of some times, s.
        look: of the pictures.
        still, part, show: as of :func:`render_run`.

    Raises:
        KhrError: if there is no such time, or the files cannot be written.
    """
    make_folder(base.parent)
    if still is not None:
        if still > last:
            raise KhrError(f'--still: {still:g} is not accepted; accepted: [0, {last:g}] s')
        (picture,) = draw([still])
        picture.save(f'{base}.png', optimize=True)
        return [Path(f'{base}.png')]
    start, end = part
    wanted = np.arange(start, min(last if end is None else end, last), 1.0 / look.rate).tolist()
    if not wanted:
        raise KhrError(
            f'--start {start:g}, --end {end}: nothing to show; accepted: a part of [0, {last:g}] s'
        )
    (sample,) = draw([wanted[len(wanted) // 2]])

    def drawn() -> Iterator[Image.Image]:
        for time, picture in zip(wanted, draw(wanted), strict=True):
            show('drawing', time, wanted[-1])
            yield picture

    movie, animation = Path(f'{base}.mp4'), Path(f'{base}.gif')
    with written(movie) as file, written(animation) as other:
        taken = _into_movie(file, drawn(), sample.size, look.rate)
        save_gif(other, taken, len(wanted), sample, look.rate)
    return [movie, animation]


def part_of(what: str, whole: float, show: Show) -> Callable[[float], None]:
    """Return a callback for the progress of one task."""
    return lambda seconds: show(what, seconds, whole)


def pictures(
    tracks: Sequence[Filmed], times: Sequence[float], look: Look
) -> Iterator[Image.Image]:
    """Draw all runs at each time, beside one another."""
    large = replace(look, width=round(look.width * SMOOTH), height=round(look.height * SMOOTH))
    overlays = [
        Overlay(track.scenario, track.kept, large.height, track.changes) for track in tracks
    ]
    scene = PosedScene(tracks[0].scenario)
    try:
        for time in times:
            whole = Image.new('RGB', (look.width * len(tracks), look.height))
            for number, (track, overlay) in enumerate(zip(tracks, overlays, strict=True)):
                frame = track.at(time)
                camera = large.camera(frame.truth)
                drawn, _ = scene.picture([frame.truth], camera)
                overlay.draw(drawn, frame, camera)
                small = drawn.resize((look.width, look.height), Image.Resampling.LANCZOS)
                whole.paste(small, (number * look.width, 0))
            yield whole
    finally:
        scene.close()


def within(longest: float, still: float | None, part: tuple[float, float | None]) -> None:
    """Check the times against the length of the run before it is repeated."""
    for name, time in (('still', still), ('start', part[0]), ('end', part[1])):
        if time is not None and not 0.0 <= time <= longest:
            raise KhrError(f'--{name}: {time:g} is not accepted; accepted: [0, {longest:g}] s')
    if part[1] is not None and part[1] <= part[0]:
        raise KhrError(
            f'--end: {part[1]:g} is not accepted; accepted: after --start, '
            f'({part[0]:g}, {longest:g}] s'
        )


def look_of(width: int, height: int, rate: float, panels: int = 1) -> Look:
    """Return the look of a film with some panels; refuse sizes that cannot be written."""
    for name, value, most in (('width', width, WIDEST // panels), ('height', height, WIDEST)):
        if not 64 <= value <= most or value % 2:
            raise KhrError.refused(f'--{name}', value, f'even integer in [64, {most}] px')
    if not 1.0 <= rate <= 60.0:
        raise KhrError(f'--rate: {rate:g} is not accepted; accepted: [1, 60] per s')
    return Look(width, height, rate)


def _into_movie(
    path: Path, pictures: Iterable[Image.Image], size: tuple[int, int], rate: float
) -> Iterator[Image.Image]:
    """Write pictures to a movie one by one as they are taken: a long film is large in memory."""
    writer = imageio_ffmpeg.write_frames(str(path), size, fps=rate, macro_block_size=2, quality=7)
    writer.send(None)
    try:
        for picture in pictures:
            writer.send(np.asarray(picture).tobytes())
            yield picture
    finally:
        writer.close()


def save_gif(
    path: Path, pictures: Iterable[Image.Image], count: int, sample: Image.Image, rate: float
) -> None:
    """Save so many pictures as a looping GIF at a rate, 1/s, in the colours of one of them."""
    # With one palette for all frames a GIF stores only moving parts and does not flicker.
    found = sample.quantize(GIF_COLORS, Image.Quantize.MEDIANCUT)
    palette = Image.new('P', (1, 1))
    palette.putpalette(
        [*(value for color in COLORS for value in color), *(found.getpalette() or [])]
    )
    # A GIF counts in 1/100 s, and viewers slow down what lasts less than two of them.
    every = ceil(rate / FASTEST_GIF)
    ends = np.rint(100.0 * every / rate * np.arange(ceil(count / every) + 1))
    durations = [10 * each for each in np.diff(ends).astype(int).tolist()]  # ms
    shown = islice(pictures, 0, None, every)
    frames = (each.quantize(palette=palette, dither=Image.Dither.NONE) for each in shown)
    next(frames).save(
        path, save_all=True, append_images=frames, duration=durations, loop=0, optimize=True
    )


def base_of(run: str, name: str, out: Path | None, namespace: str = '') -> Path:
    """Return the path of the files of a film, without their suffixes."""
    if out is not None:  # names contain degrees with decimals, so only these count as suffixes
        return out.with_suffix('') if out.suffix in ('.mp4', '.gif', '.png') else out
    folder = Path(run)
    stem = of_robot('film' if folder.is_dir() else name, namespace)
    return folder / stem if folder.is_dir() else Path(stem)
