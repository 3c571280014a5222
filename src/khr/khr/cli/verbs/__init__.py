"""The verbs of ``khr``, each a thin layer over the module that does the work."""
