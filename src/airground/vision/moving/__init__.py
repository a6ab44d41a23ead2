"""A camera that moves: the ground held still by fixed points (section 4.3)."""
