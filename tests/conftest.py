"""Settings of all tests."""

import pytest
from hypothesis import settings

pytest.register_assert_rewrite('tests.support')

# Times are for benchmarks: on a busy machine a property that holds may be slow. And a failure is
# to be one of the change at hand, so the examples are the same in every run;
# ``pytest --hypothesis-profile search`` looks for new ones.
settings.register_profile('khr', deadline=None, derandomize=True)
settings.register_profile('search', deadline=None)
settings.load_profile('khr')


def pytest_collection_modifyitems(items):
    """Begin with the files that take longest, so that none of them is left alone at the end."""
    patience = {}
    for item in items:
        mark = item.get_closest_marker('timeout')
        own = mark.args[0] if mark else float(item.get_closest_marker('slow') is not None)
        patience[item.path] = max(patience.get(item.path, 0.0), own)
    items.sort(key=lambda item: -patience[item.path])
