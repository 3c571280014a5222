"""A knee controller that joins the khr node graph from a package of its own."""
