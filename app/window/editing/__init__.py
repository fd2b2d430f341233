"""Selecting, and changing the scene."""
