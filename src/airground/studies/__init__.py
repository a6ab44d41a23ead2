"""The paper's experiments, repeated, and the demo."""
