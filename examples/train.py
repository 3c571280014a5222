"""Learn to stay up: a policy trained for a minute or two by PPO of Stable-Baselines3.

A push from behind, 2.5 N for 0.4 s, meets the standing robot. The policy is linear: a gain of
ankles and hips for each number that the robot observes. Doing nothing, the robot falls in most
episodes. Train with several seeds: with one it may stay up in nearly all episodes, with another
in few.

pip install -r examples/training-requirements.txt
python examples/train.py --seed 0
"""

import argparse

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

import khr

PUSH = 't=0.3 duration=0.4 link=base_link frame=odom force=2.5,0,0 point=0,0,0.05'
SET = {'simulator.pushes': [PUSH], 'simulator.duration': 4, 'simulator.surface': 'rubber'}
UNSEEN = range(1_000_000, 1_000_020)  # seeds of episodes that no training has drawn


def make():
    """Return the environment; in each episode the robot is placed with another small error."""
    tilt = {'simulator.initial_tilt_deg': 0.3}
    return khr.env('stand_0deg', engine='mujoco', set=SET | tilt)


def judge(name, act):
    """Print the mean reward over unseen episodes, and in how many the robot stays up."""
    environment, total, up = make(), 0.0, 0
    for seed in UNSEEN:
        (observation, _), over = environment.reset(seed=seed), False
        while not over:
            observation, reward, fell, cut, _ = environment.step(act(observation))
            total, over = total + reward, fell or cut
        up += not fell
    print(f'{name}: mean reward {total / len(UNSEEN):.2f}, up in {up} of {len(UNSEEN)} episodes')


parser = argparse.ArgumentParser()
parser.add_argument('--seed', type=int, default=0)
parser.add_argument('--steps', type=int, default=30_000)
asked = parser.parse_args()
torch.set_num_threads(1)  # the policy is small
judge('nothing', lambda _: np.zeros(2))
scaled = VecNormalize(make_vec_env(make, seed=asked.seed))
small = {'net_arch': [], 'log_std_init': -1.5}
model = PPO('MlpPolicy', scaled, learning_rate=3e-3, n_steps=1024, batch_size=256,
            policy_kwargs=small, seed=asked.seed, device='cpu')  # fmt: skip
model.learn(asked.steps)
judge('learned', lambda seen: model.predict(scaled.normalize_obs(seen), deterministic=True)[0])
