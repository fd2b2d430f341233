"""Training of the embedded network: cached rooms, losses, stages, the loop."""
