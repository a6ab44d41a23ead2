"""The live system: one loop from camera to robots, on one clock, that can be recorded and replayed."""
