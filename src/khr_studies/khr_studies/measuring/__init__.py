"""Measurements that the studies share: conditions, the run table, limits, thesis values."""
