"""Style of all plots, and the plotted points as CSV."""
