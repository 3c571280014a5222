"""The folder of a bout, and those of its rounds."""

import pytest

from khr.cli.verbs.recordings import verify_bag
from khr_bringup.bout.bout import load_bout
from khr_common.errors import KhrError


@pytest.mark.parametrize('part', ['round_1', 'round_2/bag'])
def test_a_round_alone_is_not_verified(part, tmp_path):
    (tmp_path / 'scenario.yaml').write_text(load_bout('shove').to_yaml())
    (tmp_path / part).mkdir(parents=True)
    with pytest.raises(KhrError) as refusal:
        verify_bag(tmp_path / part)
    assert str(refusal.value) == (
        f'{tmp_path / part}: a round of a bout; accepted: the folder of its bout, {tmp_path}'
    )
