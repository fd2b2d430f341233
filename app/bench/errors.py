"""What a mode's pictures and answers lose against the float64 reference."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import interpolate

from langflash_core.language.relevance import relevance_maps
from langflash_core.language.settings import ANSWERING
from langflash_core.splat import render
from langflash_core.types import Camera

from .cases import Case, in_float64


@dataclass(frozen=True)
class View:
    """One view as drawn: rgb (H, W, 3), relevance (P, H, W), covered (H, W) bool where it shows the scene."""

    rgb: Tensor
    relevance: Tensor
    covered: Tensor


@dataclass(frozen=True)
class Errors:
    """Over all views: `psnr` in dB, infinite for equal pictures; absolute errors of relevance at covered
    pixels; `mask_iou` of all masks together, None where the reference and the mode mark nothing."""

    psnr: float
    relevance_mean: float
    relevance_max: float
    mask_iou: float | None


def true_view(case: Case, camera: Camera) -> View:
    """The view by the reference, float64, F formed in all C channels; on a CUDA device if there is one."""
    device = "cuda" if torch.cuda.is_available() else "cpu"
    scene = _moved(in_float64(case.scene), device)
    frame = render(scene, camera)
    assert frame.weight_maps is not None
    relevance = relevance_maps(frame.weight_maps, _moved(case.uncompiled, device))
    return View(frame.rgb.cpu(), relevance.cpu(), (frame.alphas >= ANSWERING.covered_alpha).cpu())


def errors_of(drawn: Sequence[View], truth: Sequence[View], threshold: float) -> Errors:
    """Compare views of one mode with those of the reference.

    A smaller picture is magnified linearly, as a window shows it. Pixels count as covered where the
    reference's are.

    Args:
        threshold: relevance from which a pixel belongs to a mask.
    """
    squares, differences, both, either = [], [], 0, 0
    for mine, true in zip(drawn, truth, strict=True):
        rgb, relevance = _magnified(mine, true)
        squares.append((rgb.clamp(0, 1) - true.rgb.clamp(0, 1)).square().flatten())
        differences.append((relevance - true.relevance).abs()[:, true.covered].flatten())
        marked = (relevance >= threshold) & true.covered, (true.relevance >= threshold) & true.covered
        both += int((marked[0] & marked[1]).sum())
        either += int((marked[0] | marked[1]).sum())
    square = float(torch.cat(squares).mean())
    difference = torch.cat(differences)
    return Errors(
        math.inf if square == 0 else -10 * math.log10(square),
        float(difference.mean()) if len(difference) else 0.0,
        float(difference.max()) if len(difference) else 0.0,
        both / either if either else None,
    )


def _magnified(mine: View, true: View) -> tuple[Tensor, Tensor]:
    """rgb and relevance in float64, of the true view's size."""
    rgb, relevance = mine.rgb.double(), mine.relevance.double()
    size = true.covered.shape
    if rgb.shape[:2] == size:
        return rgb, relevance
    larger = interpolate(
        torch.cat((rgb.movedim(-1, 0), relevance))[None], size=size, mode="bilinear", align_corners=False
    )[0]
    return larger[:3].movedim(0, -1), larger[3:]


def _moved(held, device: str):
    """A dataclass with its tensors, and those of dataclasses in it, on `device`."""
    import dataclasses

    def moved(value):
        if isinstance(value, Tensor):
            return value.to(device)
        return _moved(value, device) if dataclasses.is_dataclass(value) else value

    fields = {field.name: moved(getattr(held, field.name)) for field in dataclasses.fields(held)}
    return dataclasses.replace(held, **fields)
