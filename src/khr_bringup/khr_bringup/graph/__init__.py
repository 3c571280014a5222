"""A graph of nodes: started, followed, changed while it runs, ended."""
