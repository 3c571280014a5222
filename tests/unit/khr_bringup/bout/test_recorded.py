"""The folder of a bout; a round that is repeated with all that came from outside."""

from dataclasses import replace

import pytest

from khr.cli.verbs.recordings import verify_bag
from khr_bringup.bout.bout import load_bout
from khr_bringup.bout.offline import Influences, run_bout
from khr_bringup.bout.recorded import record_bout
from khr_bringup.changes import Change
from khr_bringup.recorded.bags import read_messages
from khr_common.errors import KhrError
from khr_common.interfaces import STATE

SHORT = load_bout('shove').set_to(['simulator.engine=mujoco', 'referee.time_limit=0.3'])
PUSH = 't=0.03 duration=0.1 link=torso frame=odom force=5.0,0.0,0.0 point=0.0,0.0,0.0'


def hashed(bout, influences=()):
    return run_bout(bout, influences=dict(influences)).rounds[0].trajectory_hash


def test_the_rules_judge_a_round_whatever_is_changed_in_a_monitor():
    rules = SHORT.set_to(['referee.down_time=0.1'])
    low = Change('monitor', 'fall_height', 1.0, -1)  # a robot that sinks by anything has fallen
    changed = run_bout(rules, influences={(0, 'red'): Influences(changes=(low,))})
    assert changed.rounds[0].outcomes['red'].fell
    assert changed.rounds[0].decision == run_bout(rules).rounds[0].decision


@pytest.mark.slow
def test_changes_and_pushes_act_on_their_robot_alone():
    untouched = hashed(SHORT)
    gain = Change('ankle_controller', 'gain', 60.0, -1)  # from the start
    found = {
        'gain': hashed(SHORT, [((0, 'red'), Influences(changes=(gain,)))]),
        'push': hashed(SHORT, [((0, 'blue'), Influences(pushes=(PUSH,)))]),
        'round': hashed(SHORT, [((1, 'red'), Influences(pushes=(PUSH,)))]),  # there is no other
    }
    lean = Change('ankle_controller', 'lean_deg', 5.0, -1)
    leant = {
        hashed(SHORT, [((0, 'red'), Influences(changes=(replace(lean, after_ns=after),)))])
        for after in (-1, 150_000_000)
    }
    assert len(leant - {untouched}) == 2, 'a change acts after its sample'
    assert found == {
        'gain': hashed(SHORT.set_to(['red.ankle_controller.gain=60.0'])),
        'push': hashed(SHORT.set_to([f'blue.simulator.pushes=["{PUSH}"]'])),
        'round': untouched,
    }
    assert len(set(found.values())) == 3


@pytest.mark.slow
def test_a_decided_round_is_complete_if_the_next_one_is_interrupted(tmp_path):
    bout, before = SHORT.set_to(['referee.rounds=3']), []

    def interrupt(time):
        if time > 0.36:
            before.extend(read_messages(tmp_path / 'round_1', [STATE], namespace='red')[STATE])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record_bout(bout, tmp_path, record=True, show=interrupt)
    (state,) = before  # complete while the second round goes on
    assert {each.key: each.value for each in state.values}['trajectory_hash']
    assert not read_messages(tmp_path / 'round_2', [STATE], namespace='red')[STATE]


@pytest.mark.parametrize('part', ['round_1', 'round_2/bag'])
def test_a_round_alone_is_not_verified(part, tmp_path):
    (tmp_path / 'scenario.yaml').write_text(load_bout('shove').to_yaml())
    (tmp_path / part).mkdir(parents=True)
    with pytest.raises(KhrError) as refusal:
        verify_bag(tmp_path / part)
    assert str(refusal.value) == (
        f'{tmp_path / part}: a round of a bout; accepted: the folder of its bout, {tmp_path}'
    )
