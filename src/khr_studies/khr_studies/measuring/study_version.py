"""The version of the code that determines the results of a study."""

from __future__ import annotations

from khr_bringup.code_version import code_version


def version_of_study(study: str) -> str:
    """Return a digest of the code of the runs, the measurements and a study, given by its folder.

    Stored results are reused while it stays the same.
    """
    return code_version(*sources_of_study(study))


def sources_of_study(study: str) -> tuple[tuple[str, str], ...]:
    """Return the code of measurements and study: packages, and patterns of files in them."""
    return (
        ('khr_analysis', '**/*.py'),
        ('khr_studies', 'measuring/*.py'),
        ('khr_studies', f'{study}/study.py'),
    )
