"""Recovery from pushes that planted feet cannot hold: a step."""
