"""Pictures to look at what was judged, a module each."""
