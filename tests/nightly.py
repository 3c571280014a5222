"""What ``make nightly`` alone runs besides whole studies: long tests that find least alone.

A test that is here takes from 7 to 165 s, and what it would find is found by day in most cases by
what stands beside it. Whoever changes what a line is about runs its test as well.
"""

BY_NIGHT = {
    'tests/golden/test_hashes.py::test_emulated_processors_take': 'all hashes on this processor, and with its kernels',
    'tests/graph/driver/test_run.py::test_a_driver_runs_in_a_namespace': 'namespaces of a simulated run; a driver in lockstep',
    'tests/graph/driver/test_run.py::test_system_time_jitter': 'late and lost samples of the board; a driver in lockstep',
    'tests/graph/test_board.py::test_the_board_closes_the_loop_itself': 'the loop on the board, stepped, against the twin',
    'tests/graph/test_changed_runs.py::test_a_run_with_changes_and_pushes_verifies[--processes]': 'the same in one process',
    'tests/graph/test_equality.py::test_a_loaded_machine_changes_nothing': 'answers late and in odd order, by hand',
    'tests/graph/test_equality.py::test_offline_one_process_and_nine_give_the_same_bits[lift': 'the walk on the same engine',
    'tests/graph/test_equality.py::test_offline_one_process_and_nine_give_the_same_bits[walk_8.88deg_ka18-mujoco': 'the walk on the other engine; golden hashes of this one',
    'tests/graph/test_equality.py::test_without_delay': 'the plant with and without delay, offline',
    'tests/graph/test_full_disk.py::test_a_full_disk_stops_the_recording_only[--processes]': 'the same in one process',
    'tests/graph/test_live.py::test_a_signal_leaves_a_readable_bag': 'SIGINT, after a gain has changed',
    'tests/graph/test_namespaces.py::test_a_second_source_ends': 'a second source of any topic',
    'tests/graph/test_namespaces.py::test_two_robots_have_the_results': 'two runs that do not meet',
    'tests/graph/test_page_charts.py::test_a_camera_that_does_not_follow': 'the other controls of the page',
    'tests/graph/test_recording.py::test_a_killed_recorder_leaves': 'bags of killed recorders are recovered',
    'tests/graph/test_recording.py::test_run_that_waits_for_a_recorder_in_vain': 'a recorder that is killed',
    'tests/graph/test_recording.py::test_run_waits_for_a_recorder_that_is_far_behind': 'every recorded run is whole',
    'tests/graph/test_services.py::test_realtime_keeps_the_wall_clock': 'real time that cannot be held',
    'tests/graph/test_stage.py::test_offline_one_process_and_ten': 'the walk in three ways; stages offline',
    'tests/installation/test_colcon.py::': 'what the wheels hold; dependencies of the packages compared; the tests themselves',
    'tests/installation/test_site.py::test_every_document_becomes_a_page': 'links of the documents',
    'tests/installation/test_wheels.py::test_the_parts': 'the tests themselves, on the same wheels',
    'tests/installation/test_wheels.py::test_the_steps_of_the_dockerfile': 'make run, and what the parts need',
    'tests/installation/test_wheels.py::test_the_whole_is_its_parts': 'dependencies of the packages compared',
    'tests/integration/test_documents_run.py::test_a_reader': 'verbs and options of every command in the documents',
    'tests/integration/test_examples.py::test_a_sweep_is_drawn_as_a_map': 'sweeps and maps by the command',
    'tests/integration/test_examples.py::test_the_largest_push_grows': 'pushes of robot and models',
    'tests/integration/test_examples.py::test_the_notebook': 'the first walk of the scripts',
    'tests/integration/test_extension.py::test_three_ways_of_running': 'three files are enough; the runs of its document agree',
    'tests/integration/test_reproduce.py::test_some_figures': 'figures, and the store of what was measured',
    'tests/integration/test_sweep_cluster.py::test_a_scheduler_that_dies': 'a worker that is killed on this machine',
    'tests/integration/test_sweep_cluster.py::test_a_worker_killed_midway': 'the same on this machine',
    'tests/integration/test_sweep_workers.py::test_a_sweep_killed_midway': 'a worker that is killed; an interrupted sweep',
    'tests/reliability/test_campaign.py::test_the_short_form': 'the harms one by one; the page from a journal',
    'tests/reliability/test_closed.py::test_another_machine_takes_part': 'one that is not asked to',
    'tests/reliability/test_closed.py::test_nothing_of_a_run_listens_beyond_the_loopback[--processes]': 'the same in one process; another machine',
    'tests/reliability/test_fuzz.py::test_a_few_damaged_runs': 'bags that are damaged, byte by byte',
    'tests/reliability/test_no_hang.py::test_a_frozen_process_ends_the_run_by_name[--processes': 'a frozen graph in one process, a silent node',
    'tests/reliability/test_no_hang.py::test_a_killed_khr_leaves_no_process_and_no_domain_for_the_next[--one-process-None]': 'the same with ten processes',
    'tests/reliability/test_no_hang.py::test_a_killed_khr_leaves_no_process_and_no_domain_for_the_next[--processes-recorder]': 'the same with nobody frozen',
    'tests/reliability/test_other_user.py::test_what_another_user_changes': 'changes by the same user are replayed',
    'tests/reliability/test_other_user.py::test_who_publishes': 'who takes part ends the run',
    'tests/reliability/test_traffic.py::test_a_second_gait_of_another_run': 'a second source of any topic',
    'tests/reliability/test_traffic.py::test_a_second_source_of_an_owned_topic_ends_the_run_by_name[imu': 'clock and outcome',
    'tests/reliability/test_traffic.py::test_a_second_source_of_an_owned_topic_ends_the_run_by_name[simulator': 'clock and outcome',
    'tests/reliability/test_traffic.py::test_malformed_messages_on_shared_topics': 'every parser is fuzzed',
    'tests/reliability/test_viewers.py::': 'viewers change nothing of a run',
    'tests/reliability/test_workers_elsewhere.py::': 'workers of a scheduler on this machine',
    'tests/unit/khr/test_environment.py::test_memory_stays_flat_over_many_resets[bullet': 'the same on the other engine',
    'tests/unit/khr/test_examples.py::test_an_example_does_what_it_says[critical]': 'a limit by the Python API',
    'tests/unit/khr/test_examples.py::test_an_example_does_what_it_says[stage3]': 'the plane of one point',
    'tests/unit/khr/test_examples.py::test_an_example_does_what_it_says[tune]': 'gains tuned by the Python API',
    'tests/unit/khr_studies/third_stage/test_stage3.py::test_a_plane_is_measured_once': 'a climb, and planes that are invented',
    'tests/unit/khr_sweeps/test_bisection.py::test_each_line_is_bisected': 'limits in rounds that are invented; one by the Python API',
}  # fmt: skip


def is_by_night(test: str) -> bool:
    """Return whether a test, by its path and name, is left to ``make nightly``."""
    return any(test.startswith(each) for each in BY_NIGHT)
