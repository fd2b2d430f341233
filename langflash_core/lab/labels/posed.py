"""A posed clip with what was collected of it, as a folder of labelled photos."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from langflash_core.errors import InputError
from langflash_core.lab.labels.storage import LABELS, ClipLabels, read_labels
from langflash_core.lab.photos import PhotoFolder, open_folder


@dataclass(frozen=True)
class CollectedFolder(PhotoFolder):
    """The frames that have labels; an id of a pixel is a number of `collected`, 0 = nobody's."""

    collected: ClipLabels = field(default=None)  # type: ignore[assignment]

    @property
    def labelled(self) -> bool:
        return True

    def labels(self, id: str) -> np.ndarray:
        """Numbers (H, W) of a frame, which was cropped before it was labelled."""
        return self.collected.ids[self.ids.index(id)].astype(np.int64)


def open_collected(clip: Path, labelled: Path) -> CollectedFolder:
    """A clip (`images/`, `K.txt`, `poses.txt`) with its labels.

    Args:
        labelled: the clip's own folder of those that `langflash lab labels` writes.

    Raises:
        InputError: labels are missing, damaged, or of other frames; or a pose is not known.
    """
    labels = read_labels(labelled / LABELS)
    if not (clip / "images").is_dir():
        raise InputError(f"{clip} has no poses; put its frames into {clip / 'images'}, {_POSES}")
    folder = open_folder(clip)
    if not set(labels.frames) <= set(folder.ids):
        raise InputError(f"{labelled / LABELS} is of other frames than {clip} has; collect them again")
    if not set(labels.frames) <= (folder.poses or {}).keys():
        raise InputError(f"{clip} has frames without poses; put all into its poses.txt, {_POSES}")
    return CollectedFolder(
        folder.root, labels.frames, {}, folder.crop, folder.depth_unit, folder.Ks, folder.poses, labels
    )


_POSES = "a line an id and 16 numbers, camera to world, and intrinsics into K.txt"
