"""What the studies share: conditions, limits, experiments, published results."""
