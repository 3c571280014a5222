"""A robot in a namespace of a domain that others share, as a launch file starts one."""

import signal
import subprocess
import sys

from khr_bringup.graph.wiring import Robots, Wiring
from khr_bringup.node_registry import registry


def python(*arguments, **options):
    return subprocess.Popen([sys.executable, '-m', *map(str, arguments)], text=True, **options)


class Robot:
    """A run in a namespace: its nodes in one process, and what waits for its verdict.

    It lives in the domain of this process's environment.
    """

    def __init__(self, namespace, scenario, folder):
        self.scenario, self.folder = scenario, folder
        folder.mkdir()
        file, wiring = (
            folder / 'scenario.yaml',
            Wiring.derive(Robots.alone(scenario), folder).write(folder),
        )
        file.write_text(scenario.to_yaml())
        self.ros = ['--ros-args', '-r', f'__ns:=/{namespace}']
        entries = [registry()[node].entry for node in scenario.nodes]
        files = ('--params-file', file, '--params-file', wiring)
        self.graph = python('khr_common.nodes.run', *entries, *self.ros, *files)
        self.verdict = python(
            *('khr_bringup.verdict', file, '--out', folder, *self.ros),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )

    def end(self):
        """Wait for the verdict; end the nodes; return exit code, output and errors."""
        out, err = self.verdict.communicate(timeout=90)
        self.graph.send_signal(signal.SIGINT)
        self.graph.wait(30.0)
        return self.verdict.returncode, out, err

    def kill(self):
        """End what is left."""
        for process in (self.graph, self.verdict):
            if process.poll() is None:
                process.kill()
                process.wait()


def hash_in(out):
    return out.rpartition('trajectory hash ')[2].strip()
