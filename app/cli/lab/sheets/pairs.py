"""A sheet to judge a checkpoint by eye: what becomes of pairs of photos, and what phrases find in them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from langflash_core import pipeline
from langflash_core.base.picture_files import opened_picture
from langflash_core.export.colours import heat
from langflash_core.export.png import heat_over, to_8bit
from langflash_core.export.sheet import add_caption
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.quaternions import matrices_to_quats, quats_to_matrices
from langflash_core.reconstruction.networks import Networks
from langflash_core.scene.exposure import lit_camera
from langflash_core.types import Camera, Scene

from ...renderers import Renderer

PROMPTS = (
    "book", "floor", "plant", "flower pot", "table", "picture frame", "monitor", "chair", "door", "toy",
)  # fmt: skip
_HEIGHT = 240  # pixels of one picture
_BESIDE = 0.6  # of the baseline, to the outside of view 0
_NEAR_SHARE = 0.05  # of a view's depths are nearer than where the depth colours begin


def pair_sheet(
    pairs: Sequence[tuple[Path, Path]],
    renderer: Renderer,
    *,
    weights: Path | None = None,
    prompts: Sequence[str] = PROMPTS,
    columns: int = 8,
) -> Image.Image:
    """Per pair a band: both photos, the scene from view 0, from between, from beside and its depth,
    then every phrase in view 0 with its score; phrases that are not found stay dark.

    Raises:
        LangFlashError: a photo or the checkpoint cannot be used.
    """
    bands, networks = [], Networks()
    for pair in pairs:
        scene = pipeline.reconstruct(pair, weights=weights, networks=networks)
        cells = [*_views(scene, pair, renderer), *_answers(scene, renderer, prompts)]
        rows = [cells[i : i + columns] for i in range(0, len(cells), columns)]
        bands += [np.concatenate(row, axis=1) for row in rows]
    width = max(band.shape[1] for band in bands)
    padded = [np.pad(band, ((0, 0), (0, width - band.shape[1]), (0, 0))) for band in bands]
    return Image.fromarray(np.concatenate(padded))


def _views(scene: Scene, pair: Sequence[Path], renderer: Renderer) -> list[np.ndarray]:
    own = lit_camera(scene, _camera(scene, scene.viewmats[0]))
    shown = renderer(scene, own, weight_maps=False)
    between, beside = (
        lit_camera(scene, _camera(scene, _between(scene.viewmats[0], scene.viewmats[1], share)))
        for share in (0.5, -_BESIDE)
    )
    near = float(shown.depths[shown.depths > 0].quantile(_NEAR_SHARE))
    nearness = (near / shown.depths.clamp_min(near)) * (shown.alphas > 0.5)
    photos = [_photo(path, (own.width, own.height)) for path in pair]
    return [
        add_caption(photos[0], pair[0].name),
        add_caption(photos[1], pair[1].name),
        add_caption(to_8bit(shown.rgb), "view 0"),
        add_caption(to_8bit(renderer(scene, between, weight_maps=False).rgb), "between"),
        add_caption(to_8bit(renderer(scene, beside, weight_maps=False).rgb), "beside view 0"),
        add_caption(to_8bit(heat(nearness)), "nearness"),
    ]


def _answers(scene: Scene, renderer: Renderer, prompts: Sequence[str]) -> list[np.ndarray]:
    camera = _camera(scene, scene.viewmats[0])
    result = pipeline.query(scene, prompts, camera=camera, render=renderer)
    cells = []
    for answer, relevance in zip(result.answers, result.relevance, strict=True):
        view = heat_over(relevance, result.frame.rgb, answer.lit_from, result.mode)
        verdict = f"{answer.score:.2f}" if answer.found else f"not found ({answer.score:.2f})"
        cells.append(add_caption(to_8bit(view), f"{answer.prompt}: {verdict}"))
    return cells


def _camera(scene: Scene, viewmat: Tensor) -> Camera:
    width, height = scene.view_size
    return Camera(viewmat, scene.Ks[0], width, height).with_size(round(_HEIGHT * width / height), _HEIGHT)


def _between(first: Tensor, second: Tensor, share: float) -> Tensor:
    """The pose at `share` of the way from one to the other; below 0 on the far side of the first."""
    poses = invert_rigid(torch.stack((first, second)).double())
    quats = matrices_to_quats(poses[:, :3, :3])
    if float(quats[0] @ quats[1]) < 0:
        quats = torch.stack((quats[0], -quats[1]))
    mixed = torch.eye(4, dtype=torch.float64)
    mixed[:3, :3] = quats_to_matrices((1 - share) * quats[0] + share * quats[1])
    mixed[:3, 3] = (1 - share) * poses[0, :3, 3] + share * poses[1, :3, 3]
    return invert_rigid(mixed).to(first)


def _photo(path: Path, size: tuple[int, int]) -> np.ndarray:
    with opened_picture(path) as photo:
        return np.asarray(photo.convert("RGB").resize(size, Image.Resampling.LANCZOS))
