"""Search the gains of a scenario: slip against vibration."""
