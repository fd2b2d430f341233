"""Depth of many photos beside each other: swept, registered, agreed, sharpened (`surfaces.one_surface`)."""
