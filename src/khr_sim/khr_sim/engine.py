"""The physics engine, imported without the line that it prints on standard output."""

from contextlib import redirect_stdout
from io import StringIO

with redirect_stdout(StringIO()):
    import pybullet as bullet

__all__ = ['bullet']
