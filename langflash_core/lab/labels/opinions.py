"""What another network says of photos, kept beside them: one of up to 32 names a pixel, and how sure it is.

The network is a TensorFlow Lite file that takes one picture and gives scores of names, such as DeepLabV3
with MobileNetV2 and 32 names of ADE20K that MLCommons measures telephones with. What its names mean
nobody has to say: `lab/training/heard.py` counts over labelled photos what it says of what.

    opinions/ID.png   8 bits, one value for every score of the network, of the cropped photo:
                      8 * name + how sure in eighths (`SURER`)

Sizes: H W pixels of a photo, h w scores, N names.
"""

import io
import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32, UInt8
from PIL import Image

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.errors import InputError
from langflash_core.lab.labels.lite import opened_lite
from langflash_core.lab.photos import PhotoFolder

log = logging.getLogger(__name__)

SURER = (0.3, 0.45, 0.6, 0.7, 0.8, 0.9, 0.97)
"""Softmax of the likeliest name, from which on it is one level surer."""
LEVELS = len(SURER) + 1
NAMES = 256 // LEVELS


@runtime_checkable
class Opinion(Protocol):
    """Says what is where in a picture."""

    def scores(self, image: UInt8[np.ndarray, "H W 3"]) -> Float32[np.ndarray, "h w N"]:
        """Scores before the softmax."""
        ...


class LiteNetwork:
    """A network from a TensorFlow Lite file, by Google's interpreter; a picture is brought to its side, and
    what is left of the square is grey."""

    def __init__(self, path: Path, threads: int = 1):
        """Raises:
        InputError: the file is no such network.
        """
        self._net = opened_lite(path, threads)
        self._input = self._net.get_input_details()[0]
        self._side = int(self._input["shape"][1])
        self._output = self._scores_of(path)

    def _scores_of(self, path: Path) -> dict:
        """The last tensor with as many channels as names: what the argmax at the end reads, before it is
        enlarged to the picture's size."""
        found = [
            detail
            for detail in self._net.get_tensor_details()
            if len(detail["shape"]) == 4 and 1 < detail["shape"][3] <= NAMES and "BiasAdd" in detail["name"]
        ]
        if self._input["dtype"] != np.uint8 or not found:
            raise InputError(
                f"{path} does not take a picture of 8 bits and score at most {NAMES} names a pixel; give one "
                "that does"
            )
        return found[-1]

    def scores(self, image: UInt8[np.ndarray, "H W 3"]) -> Float32[np.ndarray, "h w N"]:
        height, width = image.shape[:2]
        scale = self._side / max(height, width)
        wide, high = round(width * scale), round(height * scale)
        square = np.full((1, self._side, self._side, 3), 128, np.uint8)
        small = Image.fromarray(image).resize((wide, high), Image.Resampling.BILINEAR)
        square[0, :high, :wide] = np.asarray(small)
        self._net.set_tensor(self._input["index"], square)
        self._net.invoke()
        steps, zero = self._output["quantization"]
        found = (self._net.get_tensor(self._output["index"])[0].astype(np.float32) - zero) * np.float32(steps)
        rows, columns = (max(1, round(n * found.shape[0] / self._side)) for n in (high, wide))
        return found[:rows, :columns]


def opinion_of(image: UInt8[np.ndarray, "H W 3"], network: Opinion) -> UInt8[np.ndarray, "h w"]:
    """The likeliest name and how sure it is, by the mean of the picture's scores and its mirrored self's."""
    scores = (network.scores(image) + network.scores(np.ascontiguousarray(image[:, ::-1]))[:, ::-1]) / 2
    odds = np.exp(scores - scores.max(-1, keepdims=True))
    sure = 1 / odds.sum(-1)  # of the likeliest, whose own odds are 1
    return (LEVELS * scores.argmax(-1) + np.digitize(sure, SURER)).astype(np.uint8)


def write_opinions(folder: PhotoFolder, ids: Sequence[str], network: Opinion) -> int:
    """Write what a network says of photos, into their folder; those that are there already are left.

    Returns:
        How many were written.

    Raises:
        LangFlashError: a photo cannot be read, or the folder not be written.
    """
    place, count = folder.root / "opinions", 0
    make_folder(place)
    for id in ids:
        path = place / f"{id}.png"
        if path.is_file():
            continue
        stream = io.BytesIO()
        Image.fromarray(opinion_of(np.ascontiguousarray(folder.photo(id).image), network)).save(stream, "PNG")
        write_atomically(path, stream.getvalue())
        count += 1
        if count % 200 == 0:
            log.info("%d photos", count)
    return count
