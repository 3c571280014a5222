"""The launch file under launch itself, where that is installed."""

import os
import re
import signal
import subprocess
import sys
from importlib.util import find_spec

import psutil
import pytest

from khr_bringup.graph.run_registry import registered
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario
from tests.support.drivers import PENDULUM, install_example
from tests.support.runs import Bag, wait_for

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not find_spec('launch_ros'),
        reason='launch and launch_ros are not installed; they come with a full ROS 2',
    ),
]
LAUNCH = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from ament_index_python.packages import get_package_share_directory

file = get_package_share_directory('khr_bringup') + '/launch/balance.launch.py'
arguments = [text.split(':=', 1) for text in sys.argv[1:]]
included = IncludeLaunchDescription(
    PythonLaunchDescriptionSource(file), launch_arguments=arguments
)
service = LaunchService(argv=sys.argv[1:], noninteractive=True)
service.include_launch_description(LaunchDescription([included]))
sys.exit(service.run())
"""
CHATTER = """
import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node('chatter')
publisher = node.create_publisher(String, 'chatter', 10)
timer = node.create_timer(0.05, lambda: publisher.publish(String(data='hello')))
rclpy.spin(node)
"""


class Launched:
    """A launch in the background, and what it has printed."""

    def __init__(self, folder, environment, arguments):
        self.folder, self._log = folder / 'run', folder / 'launch.txt'
        words = [f'{name}:={value}' for name, value in arguments.items()]
        with self._log.open('w') as log:
            self.process = subprocess.Popen(
                [sys.executable, '-c', LAUNCH, *words, f'out:={self.folder}'],
                env=environment,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def text(self):
        return self._log.read_text()

    @property
    def children(self):
        return psutil.Process(self.process.pid).children(recursive=True)

    def wait(self):
        return self.process.wait(110.0)

    def wait_until_recording(self):
        wait_for(
            lambda: sum(path.stat().st_size for path in self.folder.glob('bag/*.mcap')) > 100_000,
            'the recording',
        )


@pytest.fixture
def launched(tmp_path):
    example = install_example(tmp_path / 'prefix')
    environment = {
        **os.environ,
        **example,
        'AMENT_PREFIX_PATH': f'{example["AMENT_PREFIX_PATH"]}:{sys.prefix}',
        'PATH': f'{sys.prefix}/bin:{os.environ["PATH"]}',  # of the nodes' python3
        'ROS_LOG_DIR': str(tmp_path),
    }
    with registered('launch', tmp_path) as entry:
        environment |= {**entry.environment(), 'KHR_RUN': ''}
        chatter = subprocess.Popen([sys.executable, '-c', CHATTER], env=environment)
        started = []

        def start(**arguments):
            started.append(Launched(tmp_path, environment, arguments))
            return started[-1]

        yield start
        for each in started:
            if each.process.poll() is None:
                each.process.kill()
                each.process.wait()
        chatter.kill()
        chatter.wait()


def test_a_launch_ends_by_itself_with_the_verdict(launched):
    launch = launched(
        scenario='stand_0deg', duration='1.5', expect='stood', set='ankle_controller.enabled=true'
    )
    assert launch.wait() == 0, launch.text
    changes = {('simulator', 'duration'): 1.5, ('ankle_controller', 'enabled'): True}
    expected = run_offline(load_scenario('stand_0deg').changed(changes)).trajectory_hash
    assert 'stand_0deg: stood, ended by duration' in launch.text
    assert f'trajectory hash {expected}' in launch.text
    assert len(Bag(launch.folder / 'bag')['/clock']) == 101


def test_a_launch_runs_on_anybodys_driver_in_a_namespace(launched):
    launch = launched(
        scenario='stand_0deg',
        driver=PENDULUM,
        duration='3',
        expect='upright',
        namespace='lab/one',
        set='ankle_controller.enabled=true',
    )
    assert launch.wait() == 0, launch.text
    assert 'stand_0deg: upright, ended by duration' in launch.text
    assert 'judged_by sensors' in launch.text
    assert 'trajectory hash none: nothing was simulated' in launch.text
    bag = Bag(launch.folder / 'bag')
    assert len(bag['/lab/one/ankle_controller/correction']) > 100
    assert bag['/lab/one/spectrum']


def test_a_node_that_dies_ends_the_launch(launched):
    launch = launched(scenario='stand_0deg', duration='600')
    launch.wait_until_recording()
    (gait,) = [
        child for child in launch.children if 'khr_balance/gait' in ' '.join(child.cmdline())
    ]
    gait.kill()
    assert launch.wait() == 1
    assert re.search(r'gait-\d+ ended with -9', launch.text)
    assert len(Bag(launch.folder / 'bag')['/clock']) > 10


def test_an_interrupted_launch_leaves_a_whole_bag(launched):
    """Though another node publishes all the time in the domain."""
    launch = launched(scenario='stand_0deg', duration='600')
    launch.wait_until_recording()
    children = launch.children
    launch.process.send_signal(signal.SIGINT)
    assert launch.wait() == 1
    assert not any(child.is_running() for child in children)
    assert 'SIGKILL' not in launch.text
    bag = Bag(launch.folder / 'bag')
    assert bag['/simulator/state'][-1][1].message == 'finished'
    assert '/chatter' not in bag


def test_a_launch_that_is_killed_leaves_no_process_and_a_whole_bag(launched):
    launch = launched(scenario='stand_0deg', duration='600')
    launch.wait_until_recording()
    children = launch.children
    launch.process.kill()
    assert launch.wait() != 0
    wait_for(lambda: not any(child.is_running() for child in children), 'the end of all')
    assert len(Bag(launch.folder / 'bag')['/clock']) > 10
