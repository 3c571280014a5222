"""The constants of the robot that nobody published, found from what it did."""
