"""Photos in, a scene to fly through."""
