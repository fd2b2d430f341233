"""Photos in: decode, orient, read the lens from EXIF, crop and resize to one shape, triage."""

from langflash_core.images.decode import grey_photo
from langflash_core.images.views import load_views

__all__ = ["grey_photo", "load_views"]
