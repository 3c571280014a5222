"""Your own control law: the robot as a Gymnasium environment (see ``khr.BalanceEnv``).

A push from behind, 2.65 N for 0.4 s, meets a standing robot without control, with the pitch rate
fed back to its ankles, and with a law that also presses the toes down when they are loaded.

With the rate alone the robot falls later, if at all: it opposes the motion, and nothing brings
the robot back that leans. The loaded toe does.

python examples/own_control.py
"""

import numpy as np

import khr

PUSH = 't=2.0 duration=0.4 link=base_link frame=odom force=2.65,0,0 point=0,0,0.05'
RATE, FORCE = 0.19, 0.038  # actions (of 15 deg) per rad/s and per N


def nothing(observation):
    """Leave the gait as it is."""
    return np.zeros(2)


def rate(observation):
    """Oppose the pitch rate with the ankles, as the thesis's (3.14)."""
    return np.array([RATE * observation[1], 0.0])


def rate_and_force(observation):
    """Press the toes down as well when they are loaded."""
    toe, heel = observation[3] + observation[5], observation[4] + observation[6]
    return np.array([RATE * observation[1] - FORCE * (toe - heel), 0.0])


environment = khr.env(
    'stand_0deg',
    set={'simulator.pushes': [PUSH], 'simulator.duration': 6, 'simulator.surface': 'rubber'},
)
for law in (nothing, rate, rate_and_force):
    observation, info = environment.reset(seed=0)
    over = False
    while not over:
        observation, reward, fell, cut, info = environment.step(law(observation))
        over = fell or cut
    outcome = info['outcome']
    print(
        f'{law.__name__:15s} {outcome.verdict:8s} up for {info["time"]:.2f} s, '
        f'largest pitch {np.degrees(outcome.largest_pitch):.1f} deg'
    )
environment.close()
