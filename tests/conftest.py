"""Settings of all tests."""

from hypothesis import settings

# Times are for benchmarks: on a busy machine a property that holds may be slow.
settings.register_profile('khr', deadline=None)
settings.load_profile('khr')
