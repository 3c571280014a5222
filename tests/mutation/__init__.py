"""Mutation tests of the cores: what the tests would not notice."""
