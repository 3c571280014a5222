"""Scenarios, launch files and the khr command."""
