"""Photos in: decode, orient, read the lens from EXIF, crop and resize to one shape, triage.

`decode` and `pictures` import no torch; import what you need from its module.
"""
