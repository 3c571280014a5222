"""The robot in a browser: live, or played back from a bag."""
