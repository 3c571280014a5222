"""Much at once, viewers, and runs that last."""

import logging
import random
import re
import signal
import statistics
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, contextmanager, suppress

import psutil
from rcl_interfaces.srv import SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rosbags.rosbag2 import Reader

from khr_common.interfaces import TRUE_FORCES
from khr_common.processes import tied_to_parent
from tests.reliability.harms.harmed_run import BOTH, FIGURES, Run, badly_ended, command
from tests.support.browser import free_port, viewer
from tests.support.runs import KHR, finish, joined, khr, start_khr, wait_for

RATE, HAMMERED = 500, 3.0  # changes a second, and for how many
AT_ONCE = 220  # calls
# Calls that must be answered: of what comes at once a service of ROS keeps ten, and a node takes
# at least one whenever it takes part in a control period of 15 ms.
LEAST = {'calls': 10, 'changes': round(HAMMERED / 0.015)}
PATIENCE = 20.0  # s of wall time for all answers
VIEWERS, VIEWED = 10, 600.0  # of each page, and for how long, s of wall time
LONGEST = 5.0  # s of wall time that a viewer stays
SOAK = 3600  # simulated s
WALK = ('run', 'walk_6.99deg_ka12', '--set', 'simulator.engine=mujoco')


@contextmanager
def busy(loops):
    """Keep so many cores busy; whatever ends this process ends the loops."""
    with ExitStack() as stack:
        for _ in range(loops):
            loop = subprocess.Popen(
                [sys.executable, '-c', 'while True: pass'], preexec_fn=tied_to_parent()
            )
            stack.callback(loop.wait)
            stack.callback(loop.kill)
        yield


def flood(case, folder):
    """Change a parameter 500 times a second, or call 220 services at once: it verifies after."""
    run = Run(folder / 'run', case.mode, 600.0, '--set', 'simulator.pace=2')
    run.reach('run', case.chance)
    with joined(run.folder) as node:
        answers = _hammered(node, case.victim)
    run.process.send_signal(signal.SIGINT)
    faults = run.finish({130})
    done = [each for each in answers if each.done()]
    said = f'{case.mode} {case.victim}: {len(done)} of {len(answers)} answered'
    (folder / FIGURES).write_text(said)
    if len(done) < LEAST[case.victim]:
        faults.append(said)
    if not all(each.result().results[0].successful for each in done):
        faults.append(f'{case.mode} {case.victim}: refused')
    verified = command(*KHR, 'verify', run.folder)
    return faults + badly_ended(verified.returncode, verified.stderr)


def _hammered(node, what):
    """Change the gain of the ankles that often; return the answers, some of which never come."""
    client = node.create_client(SetParameters, 'ankle_controller/set_parameters')
    assert client.wait_for_service(3 * PATIENCE), 'no service'
    executor, answers = SingleThreadedExecutor(context=node.context), []
    executor.add_node(node)
    for number in range(AT_ONCE if what == 'calls' else round(RATE * HAMMERED)):
        value = Parameter('gain', value=1.0 + number / 100.0).to_parameter_msg()
        answers.append(client.call_async(SetParameters.Request(parameters=[value])))
        if what == 'changes':
            executor.spin_once(timeout_sec=0.0)
            time.sleep(1.0 / RATE)  # the rate itself
    end = time.monotonic() + PATIENCE
    while not all(each.done() for each in answers) and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)
    return answers


def viewers(_, folder):
    """Let ten viewers each of a live page and of a playback come and go, beside busy loops."""
    # The client logs an error of its own if the other side hangs up while it does.
    logging.getLogger('websockets.client').setLevel(logging.CRITICAL)
    recorded, live = folder / 'recorded', folder / 'live'
    khr(*WALK, '--duration', 4, '--out', recorded, timeout=300)
    # No faster than the clock, so it is still there when the last viewer has left.
    long = (*WALK, '--set', 'simulator.pace=1', '--duration', VIEWED + 5.0)
    run = start_khr(*long, '--view', '--out', live)
    play = start_khr(
        *('view', recorded, '--against', recorded, '--no-browser', '--port', free_port())
    )
    faults, visits = [], []
    with busy(psutil.cpu_count() or 1):
        end = time.monotonic() + VIEWED
        guests = [
            threading.Thread(target=_visit, args=(port, end, number, faults, visits))
            for port in (_port(run), _port(play))
            for number in range(VIEWERS)
        ]
        for guest in guests:
            guest.start()
        for guest in guests:
            guest.join()
    play.send_signal(signal.SIGINT)
    for each in (finish(play, recorded, 60), viewed := finish(run, live, VIEWED + 300.0)):
        faults += badly_ended(each.code, each.err)
    for log in live.glob('log/*.log'):
        faults += badly_ended(0, log.read_text(errors='replace'))
    alone = khr(*long, '--offline', '--out', folder / 'alone', timeout=VIEWED + 300.0)
    if not faults and viewed.hash != alone.hash:
        faults.append(f'hash {viewed.hash}, without viewers {alone.hash}')
    (folder / FIGURES).write_text(
        f'{len(visits)} visits in {VIEWED:g} s, {sum(visits) / 1e6:.0f} MB read'
    )
    return faults


def _port(process):
    found = wait_for(
        lambda: re.search(r'page: http://127.0.0.1:(\d+)/', process.stderr.readline()), 'page'
    )
    return int(found[1])


def _visit(port, end, number, faults, visits):
    """Open a page and leave it, again and again; one of five viewers reads nothing."""
    chance = random.Random(f'{port} {number}')
    while time.monotonic() < end:
        time.sleep(chance.uniform(0.0, 1.0))  # when it comes
        try:
            with viewer(port, reads=chance.random() > 0.2) as got:
                time.sleep(chance.uniform(0.0, LONGEST))  # how long it stays
            visits.append(sum(got))
        except Exception as error:  # of whatever kind: the viewer could not look
            faults.append(f'a viewer: {type(error).__name__}: {error}')


def soak(case, folder):
    """Run for long: memory does not grow, nothing is lost."""
    run = Run(folder / 'run', case.mode, SOAK)
    samples = []  # processes, and their memory, MB
    while run.process.poll() is None:
        with suppress(psutil.Error):
            sizes = [each.memory_info().rss / 1e6 for each in run.look().values()]
            samples.append((sum(size > 0.0 for size in sizes), sum(sizes)))
        time.sleep(1.0)  # a sample
    _, err = run.process.communicate()
    faults = badly_ended(run.process.returncode, err)
    most = max(count for count, _ in samples)  # fewer are there only at the start and the end
    whole = [size for count, size in samples if count == most]
    half, tenth = len(whole) // 2, max(1, len(whole) // 10)
    middle, end = map(statistics.median, (whole[half : half + tenth], whole[-tenth:]))
    if end > 1.05 * middle:
        faults.append(f'memory grew from {middle:.0f} to {end:.0f} MB')
    bag = run.folder / 'bag'
    large = sum(file.stat().st_size for file in bag.glob('*')) / 1e6
    (folder / FIGURES).write_text(
        f'{SOAK} s {case.mode}: memory of {most} processes {middle:.0f} MB after half of it, '
        f'{end:.0f} MB at the end; bag {large:.0f} MB'
    )
    return faults + _lost(bag)


def _lost(bag):
    expected = round(SOAK / 0.015) + 1
    with Reader(bag) as reader:
        counts = {topic: info.msgcount for topic, info in reader.topics.items()}
    wanted = ['/joint_reference', '/imu/data_raw', *(f'/{topic.name}' for topic in TRUE_FORCES)]
    return [
        f'{topic}: {counts.get(topic, 0)} of {expected} messages'
        for topic in wanted
        if counts.get(topic, 0) < expected
    ]


# By kind: what does the harm, and the cases.
HARMS = {
    '500 changes a second, 220 calls at once': (
        flood,
        [(mode, victim) for mode in BOTH for victim in LEAST],
    ),
    'ten viewers that come and go': (viewers, [('', 'run and playback')]),
    'soak': (soak, [(mode,) for mode in BOTH]),
}
