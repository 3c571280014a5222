"""Fight many bouts, and compare fighters with and without the controller."""
