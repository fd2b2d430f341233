"""Numbers of an answer as one NumPy archive."""

import io
from pathlib import Path

import numpy as np

from langflash_core.export.png import to_8bit
from langflash_core.files import write_atomically
from langflash_core.types import QueryResult


def write_npz(result: QueryResult, path: Path) -> None:
    """`relevance` (P, H, W) float32, `mask` (P, H, W) bool, `depth` (H, W) float32 in scene units,
    `rgb` (H, W, 3) uint8, and `prompts` (P,) text.

    Raises:
        OutputError: the path cannot be written.
    """
    stream = io.BytesIO()
    np.savez_compressed(
        stream,
        relevance=result.relevance.detach().cpu().float().numpy(),
        mask=result.masks.cpu().numpy().astype(bool),
        depth=result.frame.depths.detach().cpu().float().numpy(),
        rgb=to_8bit(result.frame.rgb),
        prompts=np.array([answer.prompt for answer in result.answers], dtype=np.str_),
    )
    write_atomically(path, stream.getvalue())
