"""The pushes that a standing robot holds by a step, beside those that its ankles hold."""
