"""Scenarios, runs of them as graphs and offline, and what they leave."""
