"""What the page shows, without the page."""
