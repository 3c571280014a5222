"""Data of the charts, without the page: signals over time, and spectra."""
