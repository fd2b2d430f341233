"""What opening shows."""
