"""Gait and feedback controllers for the KONDO KHR-3HV."""
