"""Detectors: a frame in, sightings with covariance out."""
