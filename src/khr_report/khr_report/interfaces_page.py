"""The interfaces of the graph for other people's parts, from the node registry."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from khr_bringup.node_registry import OWN, registry
from khr_common.block import NodeSpec
from khr_common.interfaces import JOINTS, Flow, Topic
from khr_report.page.document import Columns, Passage, markdown, table

QOS: dict[Flow, str] = {
    'period': 'reliable, volatile, 500',
    'latched': 'reliable, transient local, 1',
    'event': 'reliable, volatile, 500',
}
RATE: dict[Flow, str] = {'period': 'control period', 'latched': 'on change', 'event': 'at times'}
TAKE_ALL = ('recorder', 'page')
NOTICE = 'Written by `make docs` from the node registry.'
ON_TOPICS = (
    'Names are relative to the namespace of the robot, the clock and `tf` as well, so robots of one '
    'domain keep apart: `/tf` of the first is `/a/tf` of one in the namespace `a`. QoS is the '
    "publishers': reliability, durability, depth of the history; who subscribes with best effort "
    'matches too. The control period is 15 ms (66.7 Hz) unless `simulator.control_period` says '
    'otherwise. Every stamp is simulated time; messages of one instant carry the same stamp. Recorder and page, which take '
    'nearly all, are left out.'
)
ON_SERVICES = (
    '`simulator/reset` (`std_srvs/srv/Trigger`) ends the run and begins another at time zero, once '
    'all listeners have received what was; the recorder goes on in a bag of its own (`bag_2`). '
    '`simulator/pause` (`std_srvs/srv/SetBool`) halts time and lets it go on. All nodes have the '
    'parameter services of ROS 2; [nodes.md](nodes.md) lists what they accept.'
)
ON_LOCKSTEP = (
    'For each instant the simulator publishes what is true, stamped, and waits for the stamped '
    'answers of the nodes in its parameter `answers`. A node that takes part, in whatever language:',
    '- answers every stamp once, with that stamp, on a topic `NODE/correction` '
    '(`sensor_msgs/msg/JointState`: names of joints, and what to add to their reference, rad);\n'
    '- answers a stamp that comes again with the same message, without stepping: the simulator asks '
    'again after 0.1 s, which repairs what discovery or the network lost;\n'
    '- begins anew when a stamp goes back: that is another run;\n'
    '- reads no clock: what it computes depends on the stamps and on what came with them;\n'
    '- puts the identity of the run, from the environment variable `KHR_RUN`, into '
    '`header.frame_id` of its JointState; by hand it is empty.',
    'A node that only listens reports on `ready` (`std_msgs/msg/String`, latched: `NAME STAMP RUN`, '
    'the stamp in ns, `-` for no identity) at its start, every 1.5 s of simulated time, and at the '
    'end. If it stands in `listeners`, the run waits for it. `tf`, RViz, Foxglove, `ros2 topic echo` '
    'and the like are waited for by nobody, and change nothing.',
    'In Python `BlockNode` and `Listener` of `khr_common.nodes` do all of this '
    '([extending.md](extending.md)).',
)
ON_DRIVER = (
    'The simulator stands for robot, servos and board. A driver that takes its place publishes its '
    'topics, those marked *needed*; the others are truths that a real robot does not know: without '
    'them the monitor gives no verdict.',
    'Nobody waits for anybody: the driver publishes `clock` once in every output period of the '
    'board, as the question for the next reference, takes the newest `joint_reference` and '
    "corrections, adds them joint by joint in the order of the controllers' names, and drops what is "
    'older than `command_timeout` (0.1 s), as the simulator does with `sync: realtime`. The answer '
    'to one instant acts from the next (`control_delay: 1`). Start the others by `ros2 launch` with '
    "the simulator's executable replaced, or one by one with the `scenario.yaml` of a run, and "
    "without the nodes `gyro` and `foot_force`, whose topics are then the board's own.",
)
ON_CONTROL = (
    'With ros2_control the driver is a `SystemInterface`, and standard controllers around it do the '
    'rest. It exports 17 command interfaces, `JOINT/position`, and these state interfaces:',
    '- `JOINT/position` of the 17 joints;\n'
    '- of a sensor `imu` all ten that the broadcaster claims: `orientation.x` `.y` `.z` `.w`, '
    '`angular_velocity.x` `.y` `.z`, `linear_acceleration.x` `.y` `.z`. The gyro measures '
    '`angular_velocity.y`. The rates about x and z are 0, unless they are measured: a message with '
    'a rate that is not finite is refused. The other seven are read by no node: NaN;\n'
    '- of the sensors `left_toe`, `left_heel`, `right_toe` and `right_heel` the normal force, '
    '`force.z`, and `force.x`, `force.y` as 0, for the same reason.',
    'The controllers:',
    '- `joint_state_broadcaster` publishes `joint_states`;\n'
    '- `imu_sensor_broadcaster` (`sensor_name: imu`, `frame_id: imu_link`), its `~/imu` remapped to '
    '`imu/data_raw`; the feedback reads the pitch rate, y, in rad/s. '
    '`static_covariance_orientation` and `static_covariance_linear_acceleration` begin with -1: '
    'not measured;\n'
    '- four `force_torque_sensor_broadcaster`, each with the three forces of its sensor under '
    '`interface_names.force` and the frame of its sensor, z normal to the sole; their `~/wrench` is '
    'remapped to `foot_force/left_toe` and so on;\n'
    '- `forward_command_controller` (`interface_name: position`) takes the sum of reference and '
    'corrections on `~/commands` (`std_msgs/msg/Float64MultiArray`), in the order of the joints '
    'below.',
    '`update_rate` of the controller manager is a whole number of Hz and has to be the rate of the '
    'board: 100, 50 or 40. So `simulator.control_period` of the scenario is 0.010, 0.020 or 0.025 s; '
    'the default, 0.015 s (66.7 Hz), cannot be set there.',
    'The node that adds reference and corrections up is the one to write: it subscribes to '
    '`joint_reference` and to each `NODE/correction`, and publishes `clock` at the update rate, from '
    '0 on: the gait begins there. Nothing else gives the robot a clock, so `use_sim_time` is off in '
    'the controller manager and in its controllers. Their messages, and the corrections that answer '
    'them, bear system time: by that the node judges how old a correction is. Joints, in their order: '
    + ', '.join(f'`{joint}`' for joint in JOINTS)
    + '.',
)
ON_VIEW = (
    '`tf` holds `odom` to `base_link` and the frames below it in simulated time; the node '
    '`transforms` publishes them, and leaves the joints to `robot_state_publisher` where the launch '
    'file finds it. `ros2 launch khr_bringup balance.launch.py rviz:=true` opens RViz with '
    '`config/view/khr.rviz`. Foxglove and Lichtblick show a live graph or a bag with the layout '
    '`config/view/khr.json`: the robot moves by the `robot_description` and `tf` of the bag. '
    'PlotJuggler plots a bag with `plotjuggler -d runs/RUN/bag/*.mcap -l '
    'config/view/plotjuggler.xml`: pitch rate, foot forces, corrections, joints.'
)
ON_PUSHES = (
    'A push that is published once may come before anyone knows of its publisher; `-w 2` waits for '
    'simulator and recorder:',
    '```sh\nros2 topic pub -w 2 --once push geometry_msgs/msg/WrenchStamped '
    "'{header: {frame_id: odom}, wrench: {force: {x: 3.0}}}'\n```",
    'Each push that acts is published by the simulator on `simulator/push` and thereby in the bag; '
    'one that is not accepted is refused on `diagnostics`, with the reason.',
)


def interfaces_markdown() -> str:
    """Return the document: topics, services, answers, lockstep, drivers, views, pushes."""
    specs = [node.spec for node in registry().values() if node.spec.package in OWN]
    topics = sorted({topic for spec in specs for topic in _of(spec)}, key=lambda each: each.name)
    sources, takers = _by_topic(specs, 'publishes'), _by_topic(specs, 'subscribes')
    columns: Columns[Topic] = {
        'topic': lambda each: f'`{each.name}`',
        'type': lambda each: each.kind,
        'QoS': lambda each: QOS[each.flow],
        'frame': lambda each: each.frame,
        'rate': lambda each: RATE[each.flow],
        'from': lambda each: ', '.join(sources(each)) or _anyone(each),
        'to': lambda each: ', '.join(takers(each)) or 'whoever looks on',
    }
    (simulator,) = (spec for spec in specs if spec.name == 'simulator')
    needed: Columns[Topic] = {
        'topic': lambda each: f'`{each.name}`',
        'type': lambda each: each.kind,
        'for': lambda each: ', '.join(takers(each)) or 'whoever looks on',
        'needed': lambda each: _need(takers(each)),
    }
    passages = [
        Passage('Topics', (ON_TOPICS, table(topics, columns))),
        Passage('Services', (ON_SERVICES,)),
        Passage('Who answers whom', (table(filter(_answers, specs), _ANSWERS),)),
        Passage('What lockstep asks of a node', ON_LOCKSTEP),
        Passage(
            'A driver in place of the simulator', (*ON_DRIVER, table(simulator.publishes, needed))
        ),
        Passage('With ros2_control', ON_CONTROL),
        Passage('RViz, Foxglove, Lichtblick, PlotJuggler', (ON_VIEW,)),
        Passage('Pushes from a terminal', ON_PUSHES),
    ]
    return f'# Interfaces\n\n{markdown([NOTICE, *passages])}\n'


def _of(spec: NodeSpec) -> tuple[Topic, ...]:
    return (*spec.publishes, *spec.subscribes)


def _by_topic(specs: Iterable[NodeSpec], side: str) -> Callable[[Topic], list[str]]:
    found: dict[Topic, list[str]] = {}
    for spec in specs:
        for topic in getattr(spec, side):
            found.setdefault(topic, []).append(spec.name)
        if side == 'subscribes' and registry()[spec.name].correction:  # the board adds them all
            for topic in spec.publishes:
                found.setdefault(topic, ['simulator'])
    return lambda topic: [name for name in found.get(topic, []) if name not in TAKE_ALL]


def _anyone(topic: Topic) -> str:
    return 'every node' if topic.name.startswith('/') else 'you'


def _need(takers: list[str]) -> str:
    """Return by whom a topic of the simulator is needed on a real robot."""
    if set(takers) & {'gait', 'stage'}:
        return 'needed'
    if set(takers) <= {'gyro', 'foot_force'} and takers:
        return 'or what the sensors make of it'
    return ''


def _answers(spec: NodeSpec) -> bool:
    return spec.block is not None


def _names(topics: Iterable[Topic]) -> str:
    return ', '.join(f'`{topic.name}`' for topic in topics if topic.flow == 'period')


_ANSWERS: Columns[NodeSpec] = {
    'node': lambda each: f'`{each.name}`',
    'answers': lambda each: _names(each.subscribes),
    'with': lambda each: _names(each.publishes),
}
