"""The numbers of the thesis beside those of the models."""
