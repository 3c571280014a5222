"""The error of this package, and the check that raises it most."""

from khr_common import KhrError


class StudyError(KhrError):
    """An experiment that cannot be carried out as asked."""


def check_integer(option: str, value: int, low: int, high: int) -> None:
    """Refuse a number that an option does not accept.

    Raises:
        StudyError: if it is not in [low, high].
    """
    if not low <= value <= high:
        raise StudyError(
            f'{option}: {value} is not accepted; accepted: integer in [{low}, {high}]'
        )
