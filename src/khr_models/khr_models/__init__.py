"""The models of Dutta (2021) as exact code, each as published and as physics has it.

Signs: forward lean positive, inclination positive when the robot faces downhill, an ankle's
restoring (backward) moment positive when the toe carries more than the heel. ``form`` picks
between the equation as printed (``'published'``) and its corrected form (``'physical'``).
"""
