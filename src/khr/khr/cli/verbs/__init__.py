"""What ``khr`` can be asked to do: each verb a few lines over the module that does the work."""
