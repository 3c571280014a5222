"""Published numbers of the thesis compared with the models."""
