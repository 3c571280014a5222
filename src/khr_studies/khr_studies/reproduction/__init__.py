"""The whole thesis from one command, and what it comes to."""
