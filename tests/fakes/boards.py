"""Virtual boards with servos on a table, and the line to a board in the same process."""

from dataclasses import replace
from math import radians

from khr_common.interfaces import JOINTS
from khr_hardware.client import Client
from khr_hardware.driver import BoardDriver
from khr_hardware.gyro import REST_SAMPLES
from khr_hardware.joint_map import JointMap
from khr_hardware.parameters import BoardParameters
from khr_hardware.protocol.commands import Splitter, refusal
from khr_hardware.protocol.memory import FREE
from khr_hardware.virtual.board import PowerOnSettings, VirtualBoard

TRIMS = {0: 0, 2: -1350, 3: 1350, 12: 20, 13: -20, 18: -600, 19: 600}
AD = {0: 450, 1: 512, 2: 100}
MAP = JointMap.load()
STANCE = [0.0] * 17
for _side in 'lr':
    STANCE[JOINTS.index(f'{_side}_knee')] = radians(34.0)
    STANCE[JOINTS.index(f'{_side}_hip_pitch')] = radians(-17.0)
PARAMETERS = BoardParameters()


def bench_board(**changes):
    """Return a board of seven servos, each at its trimmed centre, and a gyro on AD1."""
    bench = TableServos({ics: 7500 + trim for ics, trim in TRIMS.items()}, AD)
    return VirtualBoard(bench, PowerOnSettings(TRIMS, ad_references={1: 512}, **changes))


class Rig:
    """A driver, its board and 17 servos on a table; the clock ticks with the output cycles.

    Periods come late by a factor; changes are those of the driver's parameters.
    """

    def __init__(self, retries=0, joint_map=MAP, config=0x809B, late=1.0, **changes):
        servos = {servo.ics: 7500 + servo.trim for servo in MAP.servos.values()}
        self.board = VirtualBoard(
            TableServos(servos, {0: 455, 1: 512}), PowerOnSettings(MAP.trims, config, {1: 512})
        )
        self.port = Loopback(self.board)
        self.client = Client(self.port, retries=retries)
        self._changes = changes
        self.spacing = late * PARAMETERS.control_period
        self.driver = BoardDriver(self.client, joint_map, self.parameters(), self.now)

    def now(self):
        """Return the time, s."""
        return self.spacing * self.board.robot.cycles

    def parameters(self, **changes):
        return replace(PARAMETERS, **(self._changes | changes))

    def period(self, reference=STANCE, corrections=()):
        self.driver.step(reference, corrections)
        self.board.cycle()
        self.driver.measure()

    def periods(self, count, reference=STANCE, corrections=()):
        for _ in range(count):
            self.period(reference, corrections)

    def connect(self):
        """Connect, and let the robot rest until its gyro is known."""
        self.driver.connect()
        return self.rest()

    def rest(self):
        for _ in range(REST_SAMPLES):
            self.driver.measure()
        return self

    def run(self, reference=STANCE):
        self.driver.start()
        while self.driver.state == 'ramping':
            self.period(reference)
        return self

    def break_line(self, command=None, sizes=range(256)):
        """Lose the replies to a command, those of some sizes alone."""

        def lose(reply):
            return b'' if command in (None, reply[1]) and len(reply) in sizes else reply

        self.port.tamper = lose

    def refuse(self, command, count):
        """Have the board refuse a command, and not do it, so many times."""
        left, answer = [count], self.board.answer

        def busy(frame):
            if frame.command != command or not left[0]:
                return answer(frame)
            left[0] -= 1
            return refusal(frame.command)

        self.board.answer = busy

    @property
    def targets(self):
        """The joint angles that the servos are sent, rad; None of a free one."""
        return [
            None if self.board.sent[servo.ics] == FREE
            else servo.angle(self.board.sent[servo.ics] - servo.trim)
            for servo in MAP.servos.values()
        ]  # fmt: skip


class Loopback:
    """A port whose board answers at once; what does not come at once does not come in time.

    ``tamper`` spoils replies on their way; by default nothing does.
    """

    def __init__(self, board, tamper=lambda reply: reply):
        self.board, self.tamper = board, tamper
        self._received, self._splitter, self._open = bytearray(), Splitter(), True

    def write(self, data):
        self._check()
        for frame in self._splitter.feed(data):
            self._received += self.tamper(self.board.answer(frame).encode())
        self._splitter.forget()
        return len(data)

    def read(self, size=1):
        self._check()
        data = bytes(self._received[:size])
        del self._received[:size]
        return data

    @property
    def in_waiting(self):
        self._check()
        return len(self._received)

    def close(self):
        self._open = False

    def _check(self):
        if not self._open:
            raise OSError('the port is closed')


class TableServos:
    """Servos on a table, without load: each is where it was sent at the end of the cycle.

    Positions by ICS number, and what the AD channels convert, in steps.
    """

    def __init__(self, positions, ad=None):
        self.positions, self.ad = dict(positions), dict(ad or {})
        self.driven, self.stretch, self.cycles = {}, {}, 0

    def measure(self):
        return self.positions

    def sense(self):
        return self.ad

    def drive(self, positions, cycle):
        """Bring servos to where they are sent; those that are set free stay."""
        self.cycles += 1
        self.driven.update(positions)
        for ics, position in positions.items():
            if ics in self.positions and position != FREE:
                self.positions[ics] = position

    def stiffen(self, stretch):
        self.stretch.update(stretch)
