"""What is asked of every clip of a run. Nothing here imports torch."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from langflash_core.batch.order import stamp
from langflash_core.errors import InputError

MASKS = ("network", "mobile-sam", "sam2")
FOLLOW = ("flow", "network", "sam2")
VECTORS = ("minilm", "clip")


@dataclass(frozen=True)
class LabelOrder:
    """How labels are made.

    masks: who proposes them; weights: its file, or for SAM 2 its folder or name, "" for our own network;
    side: pixels of the square that MobileSAM sees; follow: by what objects are carried from frame to frame;
    vectors: the space of the objects; start, count, step: which frames of a clip.
    """

    masks: str = "network"
    weights: str = ""
    side: int = 1024
    follow: str = "flow"
    vectors: str = "minilm"
    start: int = 0
    count: int | None = None
    step: int = 1
    device: str = "cpu"

    def __post_init__(self) -> None:
        for word, known in ((self.masks, MASKS), (self.follow, FOLLOW), (self.vectors, VECTORS)):
            if word not in known:
                raise InputError(f"'{word}' is unknown here; choose {', '.join(known)}")
        if self.masks != "network" and not self.weights:
            raise InputError(
                f"--masks {self.masks} needs weights, which are not shipped; name them with --weights"
            )
        if self.follow == "sam2" and self.masks != "sam2":
            raise InputError("--follow sam2 needs the same model for masks; add --masks sam2")
        if self.side % 64:
            raise InputError(f"--side {self.side} is no multiple of 64; choose 512 or 1024")

    def fingerprint(self, files: Sequence[Path]) -> str:
        """Changes with the order, and with a file's name, size or time of change."""
        weights = stamp(Path(self.weights)) if self.weights else None
        content = json.dumps([{**asdict(self), "weights": weights}, [stamp(file) for file in files]])
        return hashlib.sha256(content.encode()).hexdigest()[:16]
