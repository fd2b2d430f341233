"""PNG pictures of views and answers. Every file is whole or absent (`files.py`)."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from langflash_core.base.colormaps import HeatColours
from langflash_core.base.files import write_atomically
from langflash_core.base.picture_files import encoded
from langflash_core.export.colours import heat, label_colours
from langflash_core.export.settings import PAINTING
from langflash_core.scene.gaps import fill_gaps
from langflash_core.types import LUMA, Frame, QueryResult

USUAL = HeatColours()
RANGES = {"cosine": (-1.0, 1.0), "relevancy": (0.0, 1.0)}


def write_rgb(path: Path, rgb: Tensor) -> None:
    """Colours (H, W, 3): uint8 as they are, floats in [0, 1] rounded to 8 bits.

    Raises:
        OutputError: the path cannot be written (all writers here). ValueError: another shape.
    """
    write_atomically(path, rgb_file(rgb))


def rgb_file(rgb: Tensor) -> bytes:
    """What `write_rgb` writes."""
    return encoded(to_8bit(rgb), "PNG")


def write_mask(path: Path, mask: Tensor) -> None:
    """A mask (H, W) bool: 255 inside, 0 outside."""
    _check_map("mask", mask)
    write_atomically(path, encoded(mask.cpu().numpy().astype(np.uint8) * 255, "PNG"))


def write_grey(path: Path, values: Tensor, low: float, high: float) -> None:
    """A map (H, W) as 16 bits of grey: `low` is black, `high` is white; NaN is black.

    Raises:
        ValueError: low >= high.
    """
    _check_map("values", values)
    if not low < high:
        raise ValueError(f"low, high: expected low < high, received {low}, {high}")
    share = torch.nan_to_num((values.detach().cpu().double() - low) / (high - low), nan=0.0).clamp(0, 1)
    counts = (share * (2**16 - 1)).round().numpy().astype(np.uint16)
    write_atomically(path, encoded(counts, "PNG"))


def write_relevance(path: Path, relevance: Tensor, mode: str) -> None:
    """Relevance (H, W) over the whole range of its mode: cosine -1 to 1, relevancy 0 to 1."""
    write_grey(path, relevance, *RANGES[mode])


def write_heat(
    path: Path, relevance: Tensor, rgb: Tensor, threshold: float, mode: str, colours: HeatColours = USUAL
) -> None:
    """Relevance glowing over the view (`heat_over`)."""
    write_rgb(path, heat_over(relevance, rgb, threshold, mode, colours))


def heat_over(
    relevance: Tensor, rgb: Tensor, threshold: float, mode: str, colours: HeatColours = USUAL
) -> Tensor:
    """The view dimmed and grey where relevance is low, and in heat colours from the threshold on.

    The scale is fixed by the threshold and the mode's range, never by the map's own maximum: a
    phrase that is not in the scene stays dark. The glow starts halfway to the threshold.

    Args:
        relevance: (H, W). rgb: (H, W, 3) in [0, 1]. threshold: of presence.
        colours: the colour map, and what its ends mean.

    Returns:
        (H, W, 3) in [0, 1].
    """
    low, high = RANGES[mode]
    neutral = 0.5 * (low + high)  # cosine 0, relevancy 0.5: nothing speaks for the phrase
    neutral = min(neutral, threshold - 0.02 * (high - low))
    view = rgb.float().clamp(0, 1)
    grey = (view * view.new_tensor(LUMA)).sum(-1, keepdim=True)
    strength = torch.nan_to_num(relevance.float(), nan=low)
    glow = ((strength - (neutral + threshold) / 2) / (threshold - neutral)).clamp(0, 1)[..., None]
    first, last = colours.ends(threshold, high)
    shades = heat((strength - first) / max(last - first, 1e-6), colours.colormap)
    dimmed = PAINTING.dim * (0.7 * grey + 0.3 * view)
    lit = torch.lerp(view, shades, glow_share(grey))
    return dimmed * (1 - glow) + lit * glow


def glow_share(grey: Tensor) -> Tensor:
    """How much of a heat colour covers a photo of this brightness: all where it is dark and has nothing to
    show, or what is found in a dark room would hardly be seen."""
    return PAINTING.glow + (1 - PAINTING.glow) * (1 - grey) ** 2


def write_labels(path: Path, labels: Tensor, names: Sequence[str]) -> None:
    """A label map as a palette PNG, and its legend beside it as `<name>.json`, which names the picture.

    Args:
        labels: (H, W) integers; 0 is nothing, i is `names[i - 1]`. At most 255 names.

    Raises:
        ValueError: too many names, or a label without a name.
    """
    _check_map("labels", labels)
    if len(names) > 255 or (labels.numel() and not 0 <= int(labels.min()) <= int(labels.max()) <= len(names)):
        raise ValueError(f"labels: expected 0 to {len(names)}, at most 255, received others")
    colours = np.concatenate((np.zeros((1, 3), np.uint8), label_colours(len(names))))
    image = Image.fromarray(labels.cpu().numpy().astype(np.uint8))
    image.putpalette(colours.flatten().tolist())
    counts = torch.bincount(labels.flatten().long().cpu(), minlength=len(names) + 1)
    shares = [float(count) / max(1, labels.numel()) for count in counts]
    entries = [
        {"id": index, "label": name, "colour": "#" + bytes(colours[index].tolist()).hex(), "area": share}
        for index, (name, share) in enumerate(zip(["", *names], shares, strict=True))
    ]
    legend = json.dumps({"picture": path.name, "labels": entries}, indent=2, ensure_ascii=False)
    write_atomically(path.with_suffix(".json"), legend.encode())
    write_atomically(path, encoded(image, "PNG"))


def label_map(result: QueryResult) -> Tensor:
    """(H, W) int64: 1 + the prompt of highest relevance among those found there, 0 where none."""
    inside = torch.where(result.masks, result.relevance, -torch.inf)
    best, which = inside.max(0)
    return torch.where(torch.isfinite(best), which + 1, 0)


def write_frame(frame: Frame, path: Path) -> None:
    """A rendered view as RGB."""
    write_rgb(path, frame.rgb)


def write_answer(result: QueryResult, path: Path) -> None:
    """One picture of an answer: heat for one prompt, the view under label colours for more."""
    if len(result.answers) == 1:
        lit_from = result.answers[0].lit_from
        write_heat(path, result.relevance[0], result.frame.rgb, lit_from, result.mode)
        return
    write_rgb(path, torch.from_numpy(label_picture(result)))


def label_picture(result: QueryResult) -> np.ndarray:
    """(H, W, 3) uint8: each pixel in the colour of the phrase that fits best, dimmed where none does; gaps
    show what is around them, or labels would float on black."""
    labels = label_map(result).cpu()  # (H, W), 0 is none
    colours = np.concatenate((np.zeros((1, 3)), label_colours(len(result.answers)) / 255))
    frame = result.frame
    rgb = fill_gaps(frame.rgb.detach().cpu().float(), frame.alphas.detach().cpu().float()).clamp(0, 1)
    painted = torch.from_numpy(colours).float()[labels]
    coloured = (1 - PAINTING.label_opacity) * rgb + PAINTING.label_opacity * painted
    return to_8bit(torch.where((labels > 0)[..., None], coloured, 0.4 * rgb))


def to_8bit(rgb: Tensor) -> np.ndarray:
    """(H, W, 3) uint8; floats in [0, 1] are clamped and rounded, NaN is black."""
    if rgb.ndim != 3 or rgb.shape[-1] != 3:
        raise ValueError(f"rgb: expected (H, W, 3), received {tuple(rgb.shape)}")
    if rgb.dtype == torch.uint8:
        return rgb.cpu().numpy()
    return (torch.nan_to_num(rgb.detach().cpu().float(), nan=0.0).clamp(0, 1) * 255).round().byte().numpy()


def _check_map(name: str, values: Tensor) -> None:
    if values.ndim != 2:
        raise ValueError(f"{name}: expected (H, W), received {tuple(values.shape)}")
