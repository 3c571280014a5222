"""A child that waits for SIGINT, and then ends with the code that it was given."""

import signal
import sys


def stop(*_):
    print('stopped', flush=True)
    sys.exit(int(sys.argv[1]))


signal.signal(signal.SIGINT, stop)
print('ready', flush=True)
while True:
    signal.pause()
