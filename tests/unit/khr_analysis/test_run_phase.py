"""The phases of a run on a driver, by its clock alone."""

from khr_analysis.run_phase import RunPhase, RunPhaseParameters


def states(phase, stamps):
    return [(phase.take(stamp), phase.state)[1] for stamp in stamps]


def test_a_run_begins_with_the_first_period_and_ends_with_its_duration():
    phase = RunPhase(RunPhaseParameters(duration=0.03))
    assert states(phase, [0, 0, 15_000_000]) == ['waiting', 'waiting', 'running']
    assert phase.take(30_000_000)
    assert (phase.state, phase.end, phase.now_ns) == ('finished', 'duration', 30_000_000)
    assert not phase.take(45_000_000)
    assert phase.now_ns == 30_000_000


def test_a_run_without_duration_goes_on_until_it_is_stopped():
    phase = RunPhase(RunPhaseParameters())
    assert states(phase, [15_000_000, 10**15]) == ['running', 'running']
    phase.stop()
    assert (phase.state, phase.end) == ('finished', 'stopped')
