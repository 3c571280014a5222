"""Start, follow, change and end a graph of nodes."""
