"""The khr command."""
