"""Phrases, their answers, the dictionary."""
