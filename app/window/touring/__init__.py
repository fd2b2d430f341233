"""The guided tour of a scene: stops with names, notes at points, and a walk past them."""
