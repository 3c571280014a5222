"""State of the page, without the page."""
