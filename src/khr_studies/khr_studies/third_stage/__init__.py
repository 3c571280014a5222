"""The contribution of the hip's damping to the ankle's force control."""
