"""A virtual board that is served on a pseudo-terminal, in a thread of the test."""

import threading
from contextlib import closing, contextmanager

from khr_bringup.scenario import scenario as scenarios
from khr_bringup.virtual_robot import virtual_board
from khr_common.processes import ask_for_real_time
from khr_hardware.joint_map import JointMap
from khr_hardware.protocol.memory import FREE
from khr_hardware.virtual.server import Server
from tests.support.runs import start_khr

# A gyro without an amplifier: a gain is the board's ratio, and acts from the start.
BOARD_UNITS = [
    f'{controller}.{value}'
    for controller in ('ankle_controller', 'hip_controller')
    for value in ('gain_unit=1', 'reference_offset=-0.66', 'start_ramp=0', 'rate_delay=0')
]


@contextmanager
def served(board, folder, **options):
    """Serve a board; yield the server and the path of the line."""
    link, stop = folder / 'board', threading.Event()
    with closing(Server(board, link, **options)) as server:
        thread = threading.Thread(target=server.run, kwargs={'stop': stop.is_set})
        thread.start()
        try:
            yield server, str(link)
        finally:
            stop.set()
            thread.join()


class ServedRobot:
    """The robot of a scenario behind a virtual board in a thread, and the run that drives it."""

    def __init__(self, folder, scenario='stand_0deg', map_=''):
        self.folder, self.link = folder / 'run', folder / 'rcb4'
        self.map, self._map, self._scenario = JointMap.load(map_), map_, scenario
        chosen = scenarios.load_scenario(scenario).set_to(['simulator.engine=mujoco'])
        self.board, self.robot = virtual_board(chosen, self.map)
        self.server = Server(self.board, self.link)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self):
        ask_for_real_time(60)  # a board does not wait for a core
        self.server.run(stop=self._stop.is_set)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.pull()
        self.robot.close()

    def drive(self, *options, patience=1.0):
        """Start khr run on the board; a reply may take long, for its thread may lack a core."""
        changes = ['--set', f'board.reply_timeout={patience}']
        changes += ['--set', f'board.map={self._map}'] if self._map else []
        return start_khr(
            'run', self._scenario, '--board', self.link, '--out', self.folder, *changes, *options
        )

    def pull(self):
        """Pull the cable."""
        self._stop.set()
        self._thread.join()
        self.server.close()

    @property
    def free(self):
        """The ICS numbers of the servos without torque."""
        return [ics for ics in self.map.numbers if self.board.record(ics).reference == FREE]

    @property
    def targets(self):
        """The joint angles that driven servos keep, rad."""
        return self.map.angles({ics: self.board.record(ics).reference for ics in self.map.numbers})
