"""The course of a run on a driver, by its clock alone."""

from khr_analysis.course import Course, CourseParameters


def states(course, stamps):
    return [(course.take(stamp), course.state)[1] for stamp in stamps]


def test_a_run_begins_with_the_first_period_and_ends_with_its_duration():
    course = Course(CourseParameters(duration=0.03))
    assert states(course, [0, 0, 15_000_000]) == ['waiting', 'waiting', 'running']
    assert course.take(30_000_000)
    assert (course.state, course.end, course.now_ns) == ('finished', 'duration', 30_000_000)
    assert not course.take(45_000_000)
    assert course.now_ns == 30_000_000


def test_a_run_without_duration_goes_on_until_it_is_stopped():
    course = Course(CourseParameters())
    assert states(course, [15_000_000, 10**15]) == ['running', 'running']
    course.stop()
    assert (course.state, course.end) == ('finished', 'stopped')
