"""A run is named after the scenario that it began from."""

import pytest

from khr_bringup.scenario.scenario import load_scenario, shipped
from khr_view.model.live_run import scenario_name


@pytest.mark.parametrize('path', shipped(), ids=lambda path: path.stem)
def test_a_scenario_as_run_has_the_name_of_its_file(path, tmp_path):
    file = tmp_path / 'scenario.yaml'
    changed = load_scenario(str(path)).changed({('simulator', 'seed'): 3})
    file.write_text(changed.to_yaml())
    assert scenario_name(file.read_text()) == path.stem


def test_one_that_is_not_shipped_has_its_title(tmp_path):
    file = tmp_path / 'scenario.yaml'
    file.write_text('# On ice\n/**/gait: {ros__parameters: {motion: walk}}\n')
    assert scenario_name(file.read_text()) == 'On ice'
