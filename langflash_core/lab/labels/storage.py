"""Labels of a clip on disk, factorised: an id map a frame and one vector an object, never a feature a pixel.

    labels.safetensors     ids: PNG streams of 8 or 16 bits, end to end, as bytes, with where each ends
                           (offsets); vectors (M, C) float16; header: JSON of the rest

T frames, M objects, H W pixels, C channels.
"""

import io
import itertools
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt16
from PIL import Image
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from langflash_core.base.files import write_atomically
from langflash_core.base.picture_files import STORED, opened_picture
from langflash_core.errors import InputError

FORMAT = "langflash-labels-1"
LABELS = "labels.safetensors"
"""The file's name in a clip's folder."""


@dataclass(frozen=True)
class ObjectRow:
    """One object. id: its number, from 1; first: the frame where it first shows; frames: in how many it
    does; area: pixels of all of them; score: the proposer's, in [0, 1]; embedded: how many of its frames;
    agreement: of those vectors with their mean, a cosine."""

    id: int
    first: int
    frames: int
    area: int
    score: float
    embedded: int
    agreement: float


@dataclass(frozen=True)
class ClipLabels:
    """What a clip shows. frames: T names; ids (T, H, W) uint16, 0 = nobody's; vectors (M, C) of unit norm
    (or 0: nothing is known), row n of the object n + 1; space: of language; seconds: what took how long."""

    name: str
    frames: tuple[str, ...]
    ids: UInt16[np.ndarray, "T H W"]
    objects: tuple[ObjectRow, ...]
    vectors: Float[np.ndarray, "M C"]
    space: str
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def coverage(self) -> Float[np.ndarray, " T"]:
        """Share of each frame that is somebody's."""
        return (self.ids > 0).mean((1, 2))

    def features(self, frame: int) -> Float[np.ndarray, "H W C"]:
        """The vectors at each pixel of a frame, made now and never kept; 0 where nobody is."""
        table = np.concatenate([np.zeros((1, self.vectors.shape[1]), self.vectors.dtype), self.vectors])
        return table[self.ids[frame]]


@dataclass(frozen=True)
class LabelledPair:
    """Two frames to learn from: ids (2, H, W), and the objects of both with their vectors (n, C)."""

    frames: tuple[int, int]
    ids: UInt16[np.ndarray, "V H W"]
    numbers: UInt16[np.ndarray, " n"]
    vectors: Float[np.ndarray, "n C"]


def pairs(labels: ClipLabels, apart: range) -> Iterator[LabelledPair]:
    """Pairs of frames so far apart, one by one: expanded when they are asked for."""
    for gap in apart:
        for first in range(len(labels.frames) - gap):
            ids = labels.ids[[first, first + gap]]
            numbers = np.unique(ids)
            numbers = numbers[numbers > 0]
            yield LabelledPair((first, first + gap), ids, numbers, labels.vectors[numbers.astype(int) - 1])


def packed(labels: ClipLabels) -> bytes:
    """The file's content. Vectors lose what float16 does not hold: 5e-4 of each number."""
    streams = [encoded_map(ids) for ids in labels.ids]
    tensors = {
        "ids": np.frombuffer(b"".join(streams), np.uint8),
        "offsets": np.cumsum([0, *map(len, streams)]).astype(np.int64),
        "vectors": labels.vectors.astype(np.float16),
    }
    return save(tensors, {"format": FORMAT, "labels": described(labels)})


def described(labels: ClipLabels) -> str:
    """Everything that is no array, as JSON."""
    document = {
        "name": labels.name,
        "frames": labels.frames,
        "size": labels.ids.shape[1:],
        "objects": [asdict(row) for row in labels.objects],
        "space": labels.space,
        "seconds": labels.seconds,
    }
    return json.dumps(document)


def write_labels(labels: ClipLabels, folder: Path) -> Path:
    """Write a clip's file into a folder that is there.

    Raises:
        OutputError: it cannot be written.
    """
    path = folder / LABELS
    write_atomically(path, packed(labels))
    return path


def read_labels(path: Path) -> ClipLabels:
    """Read a clip's file.

    Raises:
        InputError: it is missing, damaged, or something else.
    """
    try:
        with safe_open(path, "numpy") as stored:
            header = stored.metadata() or {}
            if header.get("format") != FORMAT:
                raise ValueError(f"it says {header.get('format')}, not {FORMAT}")
            tensors = {name: stored.get_tensor(name) for name in ("ids", "offsets", "vectors")}
        content, ends = tensors["ids"].tobytes(), tensors["offsets"].tolist()
        streams = [content[a:b] for a, b in itertools.pairwise(ends)]
        return unpacked(header["labels"], streams, tensors["vectors"])
    except FileNotFoundError:
        raise InputError(f"there are no labels at {path}; make them with langflash lab labels") from None
    except (SafetensorError, KeyError, ValueError, TypeError, OSError, IndexError) as error:
        raise InputError(f"{path} holds no labels of a clip ({error}); make them again") from None


def unpacked(description: str, streams: Sequence[bytes], vectors: np.ndarray) -> ClipLabels:
    """Labels of their parts, which are checked against each other.

    Raises:
        KeyError, TypeError, ValueError, OSError: they are damaged.
    """
    document = json.loads(description)
    maps = [decoded_map(stream) for stream in streams]
    objects = tuple(ObjectRow(**row) for row in document["objects"])
    ids = np.stack(maps) if maps else np.zeros((0, *document["size"]), np.uint16)
    if len(maps) != len(document["frames"]) or len(vectors) != len(objects):
        raise ValueError("frames, objects and vectors are not as many")
    if ids.max(initial=0) > len(objects):
        raise ValueError(f"an id map names object {ids.max()} of {len(objects)}")
    return ClipLabels(
        name=document["name"],
        frames=tuple(document["frames"]),
        ids=ids,
        objects=objects,
        vectors=vectors.astype(np.float32),
        space=document["space"],
        seconds=document["seconds"],
    )


def encoded_map(ids: UInt16[np.ndarray, "H W"]) -> bytes:
    """PNG of one channel: 8 bits where they hold all numbers, else 16; lossless."""
    stream = io.BytesIO()
    kind = np.uint8 if ids.max(initial=0) < 256 else np.uint16
    Image.fromarray(ids.astype(kind)).save(stream, "PNG", compress_level=9)
    return stream.getvalue()


def decoded_map(content: bytes) -> UInt16[np.ndarray, "H W"]:
    """Ids of such a PNG.

    Raises:
        OSError, ValueError: it is none.
    """
    with opened_picture(content, STORED) as opened:
        return np.asarray(opened).astype(np.uint16)
