"""Weights on disk: our own files, and published ones converted to them."""
