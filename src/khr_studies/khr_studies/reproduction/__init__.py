"""Reproduce the whole thesis with one command, and state the findings."""
