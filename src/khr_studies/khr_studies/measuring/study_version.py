"""The version of the code that decides what a study measures."""

from __future__ import annotations

from khr_bringup.code_version import code_version


def version_of_study(study: str) -> str:
    """Return a digest of the code of the runs, of what is measured in them, and of a study.

    What a study keeps is used again while this stays the same.

    Args:
        study: the name of its folder.
    """
    return code_version(*sources_of_study(study))


def sources_of_study(study: str) -> tuple[tuple[str, str], ...]:
    """Return that code beside the code of the runs: packages, and patterns of files in them."""
    return (
        ('khr_analysis', '**/*.py'),
        ('khr_studies', 'measuring/*.py'),
        ('khr_studies', f'{study}/study.py'),
    )
