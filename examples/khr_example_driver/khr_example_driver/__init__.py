"""A driver that knows nothing of khr: its topics are all that joins them."""
