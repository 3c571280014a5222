"""Change a parameter of a run 500 times a second, or call 220 of its services at once.

python -m tests.reliability.harms.hammer changes | calls
"""

import sys
import time

import rclpy
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

RATE, SECONDS = 500, 3.0  # changes a second, and for how long
AT_ONCE = 220
# Calls that must be answered: of what comes at once a service of ROS keeps ten, and a node takes
# at least one whenever it takes part in a control period of 15 ms.
LEAST = {'calls': 10, 'changes': round(SECONDS / 0.015)}
PATIENCE = 20.0  # s of wall time for all answers


def main(what):
    rclpy.init(args=['--ros-args', '--disable-external-lib-logs'])
    node = rclpy.create_node('hammer')
    client = node.create_client(SetParameters, 'ankle_controller/set_parameters')
    assert client.wait_for_service(3 * PATIENCE), 'no service'
    answers = []
    for number in range(AT_ONCE if what == 'calls' else round(RATE * SECONDS)):
        value = Parameter('gain', value=1.0 + number / 100.0).to_parameter_msg()
        answers.append(client.call_async(SetParameters.Request(parameters=[value])))
        if what == 'changes':
            rclpy.spin_once(node, timeout_sec=0.0)
            time.sleep(1.0 / RATE)  # the rate itself
    end = time.monotonic() + PATIENCE
    while not all(each.done() for each in answers) and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.1)
    done = [each for each in answers if each.done()]
    refused = [each for each in done if not each.result().results[0].successful]
    print(f'{len(done)} of {len(answers)} answered')
    if len(done) < LEAST[what]:
        sys.exit(f'{len(done)} of {len(answers)} answered')
    sys.exit(f'{len(refused)} refused' if refused else 0)


if __name__ == '__main__':
    main(*sys.argv[1:])
