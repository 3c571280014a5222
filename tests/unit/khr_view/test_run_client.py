"""Changes of parameters that a page asks for, and those of other clients."""

from types import SimpleNamespace

import pytest
from rclpy.parameter import Parameter

from khr_bringup.changes import Change
from khr_view.controls import tunables
from khr_view.nodes import run_client
from khr_view.nodes.run_client import RunClient

(GAIN,) = (each for each in tunables() if each.key == ('ankle_controller', 'gain'))
TOO_MUCH = 50.0


class Parameters:
    """The parameter services of a node, which answer when they are told to."""

    def __init__(self, *_):
        self.value, self.answers = 12.0, []

    def services_are_ready(self):
        return True

    def set_parameters(self, parameters):
        (wanted,) = parameters
        accepted = wanted.value != TOO_MUCH
        self.value = wanted.value if accepted else self.value
        result = SimpleNamespace(successful=accepted, reason='too much')
        return self.future(SimpleNamespace(results=[result]))

    def get_parameters(self, names):
        read = Parameter(names[0], value=self.value).get_parameter_value()
        return self.future(SimpleNamespace(values=[read]))

    def future(self, content):
        future = SimpleNamespace(result=lambda: content)
        future.add_done_callback = lambda act: self.answers.append(lambda: act(future))
        return future


@pytest.fixture
def page(monkeypatch):
    monkeypatch.setattr(run_client, 'AsyncParameterClient', Parameters)
    page = SimpleNamespace(shown=[], create_client=lambda *_: None)
    page.client = RunClient(
        page, [GAIN], lambda _: None, lambda _, value: page.shown.append(value), lambda _: None
    )
    page.client._asked.add(GAIN.place)
    page.node = page.client._clients[GAIN.place]
    return page


def ask(page, value):
    assert page.client.ask(GAIN, value)
    page.client.send()


def answer(page):
    page.node.answers.pop(0)()


def report(page, value):
    page.client.on_changes([Change(GAIN.node, GAIN.name, value, 0)])


def test_late_reports_of_the_readers_own_changes_move_nothing_those_of_others_do(page):
    for value in (13.0, 14.0):
        ask(page, value)
        answer(page)
    report(page, 13.0)
    report(page, 14.0)
    assert page.shown == []
    report(page, 20.0)
    assert page.shown == [20.0]


def test_a_refused_value_gives_way_to_the_nodes_unless_the_reader_has_changed_it_again(page):
    ask(page, TOO_MUCH)
    answer(page)
    answer(page)
    assert page.shown == [12.0]
    ask(page, TOO_MUCH)
    answer(page)
    ask(page, 23.0)
    answer(page)  # the value that the node had before
    assert page.shown == [12.0]
    report(page, TOO_MUCH)
    assert page.shown == [12.0], 'the change to 23 is on its way'
