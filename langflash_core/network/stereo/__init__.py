"""Depth and poses of guided geometry: the monocular prior, matches, poses, the plane sweep."""
