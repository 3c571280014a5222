"""What the charts show, without the page: signals over time, and spectra."""
