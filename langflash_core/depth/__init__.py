"""Depth of many photos beside each other: edges, planes, what the sweep missed, registration
(`surfaces.one_surface`)."""
