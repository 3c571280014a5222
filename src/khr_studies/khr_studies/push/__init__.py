"""How hard a push the robot withstands."""
