"""Processes of the tests of this folder."""

import subprocess

import pytest

PATIENCE = 60.0  # s


@pytest.fixture
def start():
    """Start processes that do not outlive the test."""
    processes = []

    def start(*arguments):
        processes.append(
            subprocess.Popen(
                list(map(str, arguments)),
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        return processes[-1]

    yield start
    for process in processes:
        process.kill()
        process.communicate(timeout=PATIENCE)
