"""Sightings to tracks: who is who, where, and how fast."""
