"""Hands in MJCF, by way of the URDF that says the same."""
