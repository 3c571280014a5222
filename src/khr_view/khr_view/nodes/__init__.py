"""The node that follows a graph and serves its page."""
