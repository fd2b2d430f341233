"""The phrases and the dictionary."""
