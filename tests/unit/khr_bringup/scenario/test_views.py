"""The shipped views of RViz, Foxglove, Lichtblick and PlotJuggler show what there is."""

import json
import re
from xml.etree import ElementTree

import yaml
from rosbags.typesys import Stores, get_typestore

from khr_bringup.node_registry import registry
from khr_bringup.scenario import scenario as scenarios
from khr_common.interfaces import BODY, JOINT_STATE, WORLD

VIEWS = scenarios.CONFIG / 'view'
KNOWN = {topic for node in registry().values() for topic in node.spec.publishes}
TOPICS = {topic.name for topic in KNOWN}
STORE = get_typestore(Stores.ROS2_JAZZY)


def kind_of(kind, fields):
    """Return the type of a field within a message; of no message, the type and its size."""
    for name in fields:
        kind = dict(STORE.get_msgdef(kind).fields)[name][1]
    return kind


def test_rviz_shows_what_there_is():
    view = yaml.safe_load((VIEWS / 'khr.rviz').read_text())['Visualization Manager']
    named = [
        body['Value']
        for display in view['Displays']
        for key, body in display.items()
        if key in ('Topic', 'Description Topic')
    ]
    assert set(named) <= TOPICS, 'relative names: they hold in a namespace as well'
    assert 'robot_description' in named
    assert view['Global Options']['Fixed Frame'] == WORLD


def test_foxglove_shows_what_there_is():
    layout = json.loads((VIEWS / 'khr.json').read_text())
    panels = layout['configById']
    paths = [line['value'] for panel in panels.values() for line in panel.get('paths', [])]
    paths += [panel['topicPath'] for panel in panels.values() if 'topicPath' in panel]
    topics = {re.match(r'/([\w/]+)', path)[1] for path in paths}
    assert len(topics) > 5
    assert topics <= TOPICS
    for path in paths:
        name, *fields = re.findall(r'^/[\w/]+|(?<=\.)\w+', path)
        (topic,) = (each for each in KNOWN if f'/{each.name}' == name)
        kind_of(topic.kind, fields)
    assert panels['3D!robot']['fixedFrame'] == WORLD
    assert panels['3D!robot']['followTf'] == BODY

    def shown(part):
        return [part] if isinstance(part, str) else shown(part['first']) + shown(part['second'])

    assert sorted(shown(layout['layout'])) == sorted(panels)


def test_plotjuggler_shows_numbers_that_the_messages_have():
    curves = [
        curve.get('name') for curve in ElementTree.parse(VIEWS / 'plotjuggler.xml').iter('curve')
    ]
    assert len(curves) > 10
    for curve in curves:
        (topic,) = (each for each in KNOWN if curve.startswith(f'/{each.name}/'))
        path = curve.removeprefix(f'/{topic.name}/').split('/')
        if topic.kind == JOINT_STATE:  # PlotJuggler takes these apart by name
            assert path[0] in topic.names and path[1:] == ['position'], curve
            continue
        assert kind_of(topic.kind, path)[0] == 'float64', curve
