"""Controls follow their descriptors; requests neither pile up nor fight the reader's hand."""

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_bringup.node_registry import table_of
from khr_common.nodes.parameters import describe
from khr_common.parameters import specifications
from khr_view.controls import WATCHED, PendingChanges, Tunable, control, tunables, tunables_of


@pytest.mark.parametrize('tunable', tunables(), ids=lambda each: f'{each.node}.{each.name}')
def test_range_unit_and_meaning_are_the_table_s(tunable):
    specification = specifications(table_of(tunable.node))[tunable.name]
    found = control(tunable, describe(specification), specification.default)
    assert found.value == specification.default
    assert specification.description in found.hint and specification.accepted in found.hint
    assert found.unit == specification.unit
    if specification.kind is bool:
        assert found.minimum is found.maximum is None
    else:
        assert found.minimum == specification.minimum
        assert found.maximum == min(specification.maximum, tunable.most)


def test_a_slider_reaches_the_value_that_is_there():
    tunable = next(each for each in tunables() if each.name == 'pace')
    specification = specifications(table_of('simulator'))['pace']
    assert control(tunable, describe(specification), 50.0).maximum == 50.0


def test_what_is_fixed_or_no_number_has_no_control():
    fixed = SimpleNamespace(
        read_only=True, description='', additional_constraints='', floating_point_range=[]
    )
    assert control(Tunable('', 'n', 'p', ''), fixed, 1.0) is None
    free = SimpleNamespace(**{**vars(fixed), 'read_only': False})
    assert control(Tunable('', 'n', 'p', ''), free, 'text') is None
    assert control(Tunable('', 'n', 'p', ''), free, 1.0) is None


@given(st.lists(st.one_of(st.floats(0, 1), st.sampled_from(['send', 'answer'])), max_size=40))
def test_the_newest_value_always_arrives_and_one_request_is_under_way_at_a_time(steps):
    pending, key = PendingChanges(), ('node', 'name')
    under_way, asked, arrived = False, None, None
    for step in [*steps, 'answer', 'send', 'answer']:
        if step == 'send':
            assert not pending.due(nodes=())
            due = pending.due(nodes={'node'})
            assert not (due and under_way)
            if due:
                under_way, arrived = True, due[key]
        elif step == 'answer':
            pending.answered(key)
            under_way = False
        else:
            asked = step
            pending.ask(key, step)
    assert arrived == asked
    assert key not in pending


def test_reports_of_requested_changes_are_told_from_those_of_other_clients():
    pending, key = PendingChanges(), ('node', 'gain')

    def send(value, accepted=True):
        pending.ask(key, value)
        pending.due(nodes={'node'})
        pending.answered(key, accepted)

    for value in (12.5, 13.0, 13.5, 14.0):
        send(value)
    assert [pending.is_own(key, value) for value in (12.5, 13.0, 14.0)] == [True] * 3
    assert not pending.is_own(key, 13.5), 'that of another client: older requests are reported'
    send(99.0, accepted=False)
    assert not pending.is_own(key, 99.0)
    send(15.0)
    assert not pending.is_own(key, 20.0) and not pending.is_own(key, 15.0)


def test_robots_of_a_bout_have_controllers_apart_and_one_simulator():
    assert tunables_of(['']) == (*tunables(), *WATCHED)
    found = tunables_of(['red', 'blue'])
    assert len({each.key for each in found}) == len(found)
    gains = [each for each in found if each.key[1] == 'gain' and each.node == 'ankle_controller']
    assert [each.key[0] for each in gains] == ['red/ankle_controller', 'blue/ankle_controller']
    assert [each.group for each in gains] == ['Feedback, red', 'Feedback, blue']
    assert [each.key[0] for each in found if each.name == 'pace'] == ['simulator']
