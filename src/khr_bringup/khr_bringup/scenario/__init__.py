"""Scenario files: read, checked, changed, derived."""
