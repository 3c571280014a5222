"""Gains for one scenario: slip against vibration."""
