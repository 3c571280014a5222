"""Which gains hold which slope, and their cost in vibration and slip."""
