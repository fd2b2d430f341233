"""Numbers of an answer, or of a whole view, as one NumPy archive."""

import io
from pathlib import Path

import numpy as np

from langflash_core.base.files import write_atomically
from langflash_core.export.png import to_8bit
from langflash_core.types import Camera, Frame, QueryResult, Semantics


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


def write_view(frame: Frame, semantics: Semantics, camera: Camera, path: Path) -> None:
    """A view with its language: `rgb` (H, W, 3), `alphas` and `depth` (H, W), `weights` (H, W, K), all
    float32; `dictionary` (K, C) float32; `viewmat` (4, 4), `K` (3, 3) float64; `orthographic`
    bool; `space` text.

    The feature image, C channels a pixel, is `weights @ dictionary`: that product is what the renderer
    never has to form, and K numbers a pixel hold all of it.

    Raises:
        OutputError: the path cannot be written.
        ValueError: a frame without weight maps.
    """
    if frame.weight_maps is None:
        raise ValueError("frame: expected one drawn with weight maps, received none")
    stream = io.BytesIO()
    np.savez_compressed(
        stream,
        rgb=frame.rgb.detach().cpu().float().numpy(),
        alphas=frame.alphas.detach().cpu().float().numpy(),
        depth=frame.depths.detach().cpu().float().numpy(),
        weights=frame.weight_maps.detach().cpu().float().numpy(),
        dictionary=semantics.dictionary.detach().cpu().float().numpy(),
        viewmat=camera.viewmat.detach().cpu().double().numpy(),
        K=camera.K.detach().cpu().double().numpy(),
        orthographic=np.array(camera.orthographic),
        space=np.array(semantics.space, dtype=np.str_),
    )
    write_atomically(path, stream.getvalue())
