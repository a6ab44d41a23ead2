"""Pictures: the only place that draws. Matplotlib is imported when something is drawn, not before."""
