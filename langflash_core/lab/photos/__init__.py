"""Photos that people took, with names, depths or poses: one folder format, and converters into it."""

from langflash_core.lab.photos.folder import LabelledPhoto, Name, PhotoFolder, open_folder
from langflash_core.lab.photos.split import PARTS, chosen_ids

__all__ = ["PARTS", "LabelledPhoto", "Name", "PhotoFolder", "chosen_ids", "open_folder"]
