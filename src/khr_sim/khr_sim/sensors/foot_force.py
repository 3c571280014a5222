"""The resistive force sensors under toe and heel of each foot.

The thesis gives two resistive sensors per foot and no data; range, noise, resolution and time
constant are assumed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

from khr_common import parameter, sample_period
from khr_common.errors import KhrError
from khr_common.signals import LowPass, generator


@dataclass(frozen=True)
class FootForceParameters:
    """The parameter table of the foot-force sensors."""

    saturation: float = parameter(
        25.0, 'Largest force that a sensor can measure; the robot weighs 14.7 N.', '[1, 200] N'
    )
    noise: float = parameter(
        0.05, 'Standard deviation of the white noise of a sample.', '[0, 5] N'
    )
    resolution: float = parameter(
        0.025,
        'Resolution of the reading; 0 for none. The default is a thousandth of the range, as '
        'with the 10-bit converter of the board.',
        '[0, 5] N',
    )
    time_constant: float = parameter(0.5, 'Time constant of the low-pass; 0 for none.', '[0, 1] s')
    seed: int = parameter(0, 'Seed of the noise.', '[0, inf]', read_only=True)
    control_period: float = sample_period()


class FootForce:
    """Convert the true mean contact forces of each control period to four readings."""

    def __init__(self, parameters: FootForceParameters) -> None:
        self._low_pass = LowPass(4, parameters.control_period, parameters.time_constant)
        self._noise = generator(parameters.seed, 'foot_force')
        self.configure(parameters)

    def configure(self, parameters: FootForceParameters) -> None:
        """Apply changed parameters from the next sample on and keep the state."""
        self.parameters = parameters
        self._low_pass.configure(parameters.time_constant)

    def update(self, contact_force: Sequence[Sequence[float]]) -> tuple[float, ...]:
        """Return the readings of the sensors, in N, from 0 to the saturation.

        Args:
            contact_force: (4, 3), true forces on l_toe, l_heel, r_toe and r_heel, each in its own
                frame with z normal to the sole, N; means over the period.

        Returns:
            Four normal forces in the same order, each along the normal of its own sole.

        Raises:
            KhrError: if the forces are not (4, 3) finite numbers.
        """
        if [*map(len, contact_force)] != [3] * 4 or not isfinite(sum(map(sum, contact_force))):
            raise KhrError(
                f'contact_force: {contact_force!r} is not accepted; '
                f'accepted: (4, 3) finite forces in N'
            )
        own = self.parameters
        # Always drawn, so that the sequence depends on the seed alone.
        noise = self._noise.standard_normal(4).tolist()
        normal = self._low_pass.update([force[2] for force in contact_force])
        readings = [each + own.noise * error for each, error in zip(normal, noise, strict=True)]
        if own.resolution > 0.0:
            readings = [round(each / own.resolution) * own.resolution for each in readings]
        return tuple([min(max(each, 0.0), own.saturation) for each in readings])
