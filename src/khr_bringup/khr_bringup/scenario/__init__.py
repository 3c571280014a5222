"""Read, check and change scenario files; derive parameters."""
