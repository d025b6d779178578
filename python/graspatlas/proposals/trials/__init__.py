"""Assignments tried: first looks, and the atlases of the best."""
