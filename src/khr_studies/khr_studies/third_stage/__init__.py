"""What the hip's damping adds to the ankle's force control."""
