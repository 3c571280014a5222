"""Another machine: a network namespace with memory of its own, joined by a virtual cable."""

import json
import os
import shutil
import subprocess
import sys
from contextlib import contextmanager

from tests import ROOT

HERE, THERE = '10.213.77.1', '10.213.77.2'


def why_not():
    """Return why there can be no other machine here; empty if there can."""
    if os.geteuid() != 0:
        return 'only root can make a network namespace'
    missing = [tool for tool in ('ip', 'unshare') if shutil.which(tool) is None]
    if missing:
        return f'{missing[0]} is missing'
    name = f'khr-try-{os.getpid()}'
    tried = subprocess.run(['ip', 'netns', 'add', name], capture_output=True, check=False)
    subprocess.run(['ip', 'netns', 'del', name], capture_output=True, check=False)
    return '' if tried.returncode == 0 else 'this system gives no network namespaces'


@contextmanager
def other_machine():
    """Yield the name of a network namespace that reaches this one; it is removed again."""
    name, cable = f'khr-{os.getpid()}', f'k{os.getpid()}'

    def ip(*words):
        subprocess.run(['ip', *words], check=True, capture_output=True)

    ip('netns', 'add', name)
    try:
        ip('link', 'add', cable, 'type', 'veth', 'peer', 'name', f'{cable}b', 'netns', name)
        for where, address, device in (
            ((), HERE, cable),
            (('-n', name), THERE, f'{cable}b'),
            (('-n', name), '127.0.0.1', 'lo'),
        ):
            if device != 'lo':
                ip(*where, 'addr', 'add', f'{address}/24', 'dev', device)
            ip(*where, 'link', 'set', device, 'up')
        yield name
    finally:
        subprocess.run(['ip', 'link', 'del', cable], check=False, capture_output=True)
        subprocess.run(['ip', 'netns', 'del', name], check=False, capture_output=True)


def spied(machine, domain):
    """Return what a stranger on another machine sees of a domain, and whether it changed a gain."""
    plain = {k: v for k, v in os.environ.items() if not k.startswith(('ROS_', 'FAST', 'RMW_'))}
    ended = subprocess.run(
        ['ip', 'netns', 'exec', machine, 'unshare', '--mount', 'sh', '-c',
         f'mount -t tmpfs none /dev/shm && exec {sys.executable} -m tests.reliability.strangers.spy'],
        env={**plain, 'ROS_DOMAIN_ID': str(domain), 'ROS_STATIC_PEERS': HERE},
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout)
