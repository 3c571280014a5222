"""`tf` as every ROS 2 reads it, though `tf2_msgs` is not installed with the wheels."""

import subprocess
import sys
from importlib.util import find_spec

import pytest
from rosbags.typesys import Stores, get_typestore

from khr_bringup.graph.run_registry import registered

KIND = 'tf2_msgs/msg/TFMessage'
HASH = get_typestore(Stores.ROS2_JAZZY).hash_rihs01(KIND)
# In a process of its own: what goes wrong with addresses ends it.
PROGRAM = """
from pkgutil import resolve_name

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from type_description_interfaces.srv import GetTypeDescription

from khr_common.interfaces import TF_STATIC
from khr_common.nodes.transform_messages import transform_message
from khr_sim.node_specs import TRANSFORMS

rclpy.init()
node, other = resolve_name(TRANSFORMS.node)(TRANSFORMS), rclpy.create_node('other')
executor = SingleThreadedExecutor()
executor.add_node(node)
executor.add_node(other)
received = rclpy.Future(executor=executor)
qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
other.create_subscription(
    transform_message(), 'tf_static', lambda data: received.set_result(data), qos, raw=True
)
executor.spin_until_future_complete(received, 20.0)
(info,) = other.get_publishers_info_by_topic('tf_static')
print(info.topic_type, info.topic_type_hash, len(received.result()))
client = other.create_client(GetTypeDescription, 'transforms/get_type_description')
assert client.wait_for_service(20.0)
request = GetTypeDescription.Request(type_name=info.topic_type, type_hash=str(info.topic_type_hash))
asked = client.call_async(request)
executor.spin_until_future_complete(asked, 20.0)
found = asked.result().type_description
(field,) = found.type_description.fields
print(field.name, field.type.type_id, field.type.nested_type_name)
print(*(each.type_name for each in found.referenced_type_descriptions))
"""


@pytest.mark.skipif(bool(find_spec('tf2_msgs')), reason='tf2_msgs is installed')
def test_the_type_that_stands_for_it_has_its_name_hash_and_description(tmp_path):
    with registered('transforms', tmp_path) as entry:
        ended = subprocess.run(
            [sys.executable, '-c', PROGRAM],
            env={**entry.environment(), 'ROS_LOG_DIR': str(tmp_path), 'PATH': ''},
            capture_output=True,
            text=True,
            timeout=90,
            check=False,
        )
    assert ended.returncode == 0, ended.stderr
    published, field, referenced = ended.stdout.splitlines()
    assert published.startswith(f'{KIND} {HASH} ')
    assert field == 'transforms 145 geometry_msgs/msg/TransformStamped'
    assert referenced.split() == [
        'builtin_interfaces/msg/Time',
        'geometry_msgs/msg/Quaternion',
        'geometry_msgs/msg/Transform',
        'geometry_msgs/msg/TransformStamped',
        'geometry_msgs/msg/Vector3',
        'std_msgs/msg/Header',
    ]
