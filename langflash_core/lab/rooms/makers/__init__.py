"""Makers of furniture and of what lies about a home, by rules; `rooms.parametric` lists them."""
