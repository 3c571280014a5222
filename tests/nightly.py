"""What ``make nightly`` alone runs besides whole studies: long tests that find least alone.

A test that is here takes from 3 to 165 s, and what it would find is found by day in most cases by
what stands beside it. Whoever changes what a line is about runs its test as well.
"""

BY_NIGHT = {
    'tests/golden/test_hashes.py::test_emulated_processors_take': 'all hashes on this processor, and with its kernels',
    'tests/graph/test_board.py::test_the_board_closes_the_loop_itself': 'the loop on the board, stepped, against the twin',
    'tests/graph/test_bout.py::test_a_launched_round': 'bouts of the command; the files that a launch is given',
    'tests/graph/test_bout.py::test_each_robot_is_set_and_pushed': 'changes and pushes of a bout offline; one of a run that verifies',
    'tests/graph/test_live.py::test_realtime_keeps_the_wall_clock': 'real time that cannot be held',
    'tests/graph/test_namespaces.py::test_two_robots_have_the_results': 'two runs that do not meet',
    'tests/graph/test_page.py::test_a_phone_shows': 'the page on a wide screen; documents on a narrow one',
    'tests/graph/test_playback.py::test_two_runs_stand_side_by_side': 'one recording on the page; two robots in the report and in unit tests of the view',
    'tests/installation/test_colcon.py::': 'what the wheels hold; dependencies of the packages compared; the tests themselves',
    'tests/installation/test_wheels.py::test_docker_builds_the_image': 'what the wheels hold; it builds over the network',
    'tests/installation/test_wheels.py::test_the_steps_of_the_dockerfile': 'make run, and what the parts need',
    'tests/installation/test_wheels.py::test_the_whole_is_its_parts': 'make run builds and installs every part; their dependencies compared',
    'tests/integration/test_documents_run.py::test_a_reader': 'verbs and options of every command in the documents',
    'tests/integration/test_documents_run.py::test_every_document_becomes_a_page': 'links of the documents',
    'tests/integration/test_examples.py::test_a_first_walk': 'the other examples; its calls, in unit tests of the API',
    'tests/integration/test_examples.py::test_a_sweep_is_drawn_as_a_map': 'sweeps and maps by the command',
    'tests/integration/test_examples.py::test_the_largest_push_grows': 'pushes of robot and models',
    'tests/integration/test_examples.py::test_the_notebook': 'the first walk of the scripts',
    'tests/integration/test_recovery.py::test_the_estimate_is_within_5_mm_and_12_mm_of_the_truth_over_16_pushes[bullet': 'the step, which needs the estimate, on both engines',
    'tests/integration/test_recovery.py::test_the_estimate_is_within_5_mm_and_12_mm_of_the_truth_over_16_pushes[mujoco': 'the step, which needs the estimate, on both engines',
    'tests/integration/test_report.py::test_runs_of_different_scenarios': 'two runs of one scenario',
    'tests/integration/test_sweep_cluster.py::test_a_scheduler_that_dies': 'a job whose worker is killed, in unit tests of the pool',
    'tests/unit/khr/test_api.py::test_an_example_does_what_it_says[critical]': 'a limit by the Python API',
    'tests/unit/khr/test_api.py::test_an_example_does_what_it_says[stage3]': 'the plane of one point',
    'tests/unit/khr/test_api.py::test_an_example_does_what_it_says[sweep]': 'a sweep by the Python API',
    'tests/unit/khr/test_api.py::test_an_example_does_what_it_says[tune]': 'the search by its own unit tests, its arguments by those of the command',
    'tests/unit/test_sources.py::test_every_contract_notices': 'make lint, where all are kept',
}  # fmt: skip


def is_by_night(test: str) -> bool:
    """Return whether a test, by its path and name, is left to ``make nightly``."""
    return test.startswith(tuple(BY_NIGHT))
