"""The parameters of the page."""

from __future__ import annotations

from dataclasses import dataclass

from khr_common import fixed


@dataclass(frozen=True)
class PageParameters:
    """The parameter table of the page."""

    host: str = fixed(
        '127.0.0.1',
        'Address that it is served on; one that other machines reach makes a token necessary, '
        'which the printed address holds.',
    )
    port: int = fixed(
        0, 'Port that it is served on; 0 takes the first free one from 8090 on.', '[0, 65535]'
    )
    rate: float = fixed(
        30.0, 'Frames per second of wall time while a browser is connected.', '[1, 60] Hz'
    )
