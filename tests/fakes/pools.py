"""A pool without processes."""

from concurrent.futures import Future


class HerePool:
    """A pool that computes a job in this process as it is submitted, and counts."""

    workers = 1

    def __init__(self):
        self.count = 0

    def submit(self, function, *arguments):
        self.count += 1
        future = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future
