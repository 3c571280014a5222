"""Motion files: read key frames into a scenario, and write those of a motion to a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from khr_balance.gaits.file_plan import frames_of
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.gaits.gait_plan import plan_motion
from khr_balance.gaits.key_frames import read_key_frames
from khr_bringup.scenario.parameter_file import Values
from khr_common import build
from khr_common.errors import KhrError, quoted
from khr_common.files import write_text
from khr_common.strict_yaml import read_file
from khr_sim.run_parameters import GAIT

FORMS = {'.csv': 'csv', '.yaml': 'yaml', '.yml': 'yaml'}  # by the ending of the file's name


def with_motion(file: str, values: Values, folder: Path) -> Values:
    """Return values of nodes in which a gait with a motion file has its key frames.

    The motion is planned, so that one out of reach is refused before anything runs. Frames that
    are already there, as in a recorded run, are kept.

    Args:
        file: name of the scenario in error messages.
        values: checked parameters by node and key.
        folder: that the path of the motion file is relative to.
    """
    gait = values.get(GAIT, {})
    if not gait.get('motion_file') and gait.get('motion') != 'file':
        return values
    try:
        gait = gait if gait.get('frames') else {**gait, **_frames(gait, folder)}
        parameters = build(GaitParameters, gait)
        if parameters.motion == 'file':
            _plan(parameters)
    except KhrError as error:
        raise KhrError(f'{file}: {error}') from error
    return {**values, GAIT: gait}


def write_motion(parameters: GaitParameters, path: Path) -> list[str]:
    """Write the key frames of a motion to a CSV or YAML file.

    Returns:
        The settings (``node.key=value``) with which the file plays the same motion.

    Raises:
        KhrError: if the file's name has another ending, or the motion cannot be planned.
    """
    frames, between = frames_of(parameters, plan_motion(parameters))
    text = frames.to_yaml() if _form(str(path)) == 'yaml' else frames.to_csv()
    write_text(path, text)
    settings = ['gait.motion=file', f'gait.motion_file={path}', f'gait.between={between}']
    repeated = parameters.motion == 'file' and any(parameters.repeat)
    return settings + [f'gait.repeat={list(parameters.repeat)}'] * repeated


def _form(name: str) -> str:
    form = FORMS.get(Path(name).suffix)
    if form is None:
        raise KhrError(
            f'{quoted(name)}: no file of key frames; accepted: a name that ends in '
            + ', '.join(FORMS)
        )
    return form


def _frames(gait: Mapping[str, Any], folder: Path) -> dict[str, str]:
    """Return the parameter ``frames`` of a motion file."""
    name = gait.get('motion_file')
    if not name:
        return {}
    form = _form(name)
    if not (folder / name).is_file():
        raise KhrError(f'gait: motion_file: {quoted(name)}: no such file; accepted: a path')
    return {'frames': read_key_frames(read_file(folder / name), name, form).to_csv()}


def _plan(parameters: GaitParameters) -> None:
    try:
        gait_of(parameters)
    except KhrError as error:
        named = str(error).startswith(('gait:', f'{parameters.motion_file}:'))
        raise KhrError(f'{"" if named else parameters.motion_file + ": "}{error}') from error
