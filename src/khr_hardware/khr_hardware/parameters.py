"""The parameters of the node that drives the real robot."""

from __future__ import annotations

from dataclasses import dataclass

from khr_common import parameter


@dataclass(frozen=True)
class BoardParameters:
    """The parameter table of the node ``board``.

    Those that the simulator has as well, from ``control_period`` to ``command_timeout``, follow
    the scenario's values for the simulator. Empty text in a list stands for nothing.
    """

    port: str = parameter('/dev/ttyUSB0', 'Serial line of the board.', read_only=True)
    baud: int = parameter(
        0,
        'Rate of the line: 115200, 625000 or 1250000; 0 tries all three.',
        minimum=0,
        maximum=1_250_000,
        read_only=True,
    )
    reply_timeout: float = parameter(
        0.02,
        'Time within which a reply begins, and its rest comes; an exchange is tried three times.',
        unit='s',
        minimum=0.005,
        maximum=1.0,
        read_only=True,
    )
    map: str = parameter(
        '',
        "YAML file of servos and AD ports, or khr3hv_forces; the KHR-3HV's by default.",
        read_only=True,
    )
    control_period: float = parameter(
        0.015,
        'Output cycle of the board: 0.010, 0.015, 0.020 or 0.025.',
        unit='s',
        minimum=0.010,
        maximum=0.025,
        read_only=True,
    )
    duration: float = parameter(
        0.0,
        'Time of the run; 0 runs until stopped (khr: as long as the motion).',
        unit='s',
        minimum=0.0,
        maximum=1e6,
        read_only=True,
    )
    sync: str = parameter(
        'realtime', 'A real robot waits for nobody.', choices=('realtime',), read_only=True
    )
    answers: tuple[str, ...] = parameter(
        ('gait', 'ankle_controller', 'hip_controller'),
        'Nodes whose answers are taken: the gait, and controllers, whose corrections are added.',
        wiring=True,
    )
    command_timeout: float = parameter(
        0.1,
        'Age at which a correction is dropped, and a reference makes the robot hold.',
        unit='s',
        minimum=0.02,
        maximum=1.0,
    )
    mixing: str = parameter(
        'computer',
        "Who adds the feedback to the reference: the computer, as the graph's controllers ask, or "
        'the board, by its own mixing of the gyro; then the controllers of the graph are refused.',
        choices=('computer', 'board'),
        read_only=True,
    )
    ankle_ratio: int = parameter(
        0,
        'With mixing board: K_A, counts at both ankles per AD step of the gyro (khr: from the gain '
        'of ankle_controller).',
        minimum=0,
        maximum=127,
    )
    hip_ratio: int = parameter(
        0,
        'With mixing board: K_H, counts at both hips per AD step of the gyro (khr: from the gain of '
        'hip_controller).',
        minimum=0,
        maximum=127,
    )
    ad_offset: int = parameter(
        0,
        "With mixing board: AD steps from the gyro's voltage at rest to its reference (khr: from "
        'reference_offset of the controllers).',
        minimum=-100,
        maximum=100,
        read_only=True,
    )
    urdf: str = parameter(
        '',
        'File of the description to publish; none by default (khr: the one of the simulator).',
        read_only=True,
    )
    priority: int = parameter(
        50,
        'Real-time priority (SCHED_FIFO) of the thread that drives the board, as far as ulimit -r '
        'grants it; 0 asks for none.',
        minimum=0,
        maximum=99,
        read_only=True,
    )
    dry_run: bool = parameter(
        False, 'Do all but write positions: no servo gets torque.', read_only=True
    )
    at_exit: str = parameter(
        'free',
        'What the servos do when the node ends or meets a limit: free, for a robot on a stand, or '
        'hold.',
        choices=('free', 'hold'),
    )
    ramp_speed_deg_s: float = parameter(
        30.0,
        'Largest speed of a joint from where it was found to the first reference.',
        unit='deg/s',
        minimum=1.0,
        maximum=60.0,
    )
    positions_per_period: int = parameter(
        4,
        'Servos whose position is read in each period, in turn; a read takes the board about 1 ms.',
        minimum=0,
        maximum=17,
    )
    battery_warn: float = parameter(
        10.5, 'Voltage of the battery below which to warn.', unit='V', minimum=6.0, maximum=13.0
    )
    battery_stop: float = parameter(
        9.6,
        'Voltage that ends the run if it stays below for half a second.',
        unit='V',
        minimum=0.0,
        maximum=13.0,
    )
    torque_time: float = parameter(
        300.0,
        'Time with torque after which the run ends: no command reads the temperature of a servo.',
        unit='s',
        minimum=1.0,
        maximum=3600.0,
    )
