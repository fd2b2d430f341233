"""Pictures to tokens and features."""
