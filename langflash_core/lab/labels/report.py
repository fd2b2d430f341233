"""A clip's labels as one HTML page to look at: frames with their objects, how much is covered and how steady
it is, and every object with where it is seen best and what it is called.

T frames, M objects, H W pixels.
"""

import base64
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from jaxtyping import Float, UInt8, UInt16
from PIL import Image

from langflash_core.export.colours import label_colours
from langflash_core.lab.labels.clips import Clip
from langflash_core.lab.labels.motion import by_flow, moved
from langflash_core.lab.labels.storage import ClipLabels

SHOWN = 8
"""Frames with pictures."""
_WIDTH = 360  # pixels of a frame's picture
_CUT = 72  # pixels of an object's
_HELD = 0.55  # share of the colour over the photo
Namer = Callable[[Float[np.ndarray, "M C"]], Sequence[str]]
"""Vectors to what each is called."""

_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title><style>
:root {{ color-scheme: light dark; }}
body {{ font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 1160px; padding: 0 1em; }}
.frames {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(260px, 1fr)); gap: 12px; }}
figure {{ margin: 0; }} figure img {{ width: 100%; display: block; }}
figcaption, .soft {{ opacity: .7; font-size: 13px; }}
table {{ border-collapse: collapse; }}
th, td {{ text-align: left; padding: .3em 1em .3em 0; vertical-align: middle; }}
tbody tr {{ border-top: 1px solid #8884; }}
td.number {{ text-align: right; font-variant-numeric: tabular-nums; }}
.swatch {{ display: inline-block; width: 1.1em; height: 1.1em; border-radius: 3px; vertical-align: middle; }}
svg {{ width: 100%; height: auto; display: block; }}
</style></head><body>
"""


@dataclass(frozen=True)
class Quality:
    """Of every frame: masks (T,), how many objects; coverage (T,), share of pixels that are somebody's;
    steady (T,), share of pixels that keep their id along the optical flow from the frame before (1 for
    the first)."""

    masks: Float[np.ndarray, " T"]
    coverage: Float[np.ndarray, " T"]
    steady: Float[np.ndarray, " T"]


def quality(clip: Clip, labels: ClipLabels) -> Quality:
    """Counted, and measured on the pictures."""
    clip = clip.held()
    steady = [1.0]
    for frame in range(1, len(clip)):
        step = by_flow(clip, frame, clip.read(frame), clip.read(frame - 1))
        carried, known = moved(labels.ids[frame - 1], step)
        own = known & ((carried > 0) | (labels.ids[frame] > 0))
        steady.append(float((carried == labels.ids[frame])[own].mean()) if own.any() else 1.0)
    masks = np.array([float((np.unique(ids) > 0).sum()) for ids in labels.ids])
    return Quality(masks, labels.coverage, np.array(steady))


def report(clip: Clip, labels: ClipLabels, namer: Namer) -> tuple[bytes, Quality]:
    """The page, and its numbers."""
    measured, colours = quality(clip, labels), label_colours(len(labels.objects) + 1)
    parts = [_PAGE.format(title=escape(f"{labels.name}: labels"))]
    parts.append(f"<h1>{escape(labels.name)}</h1><p>{escape(_sentence(labels, measured))}</p>")
    parts.append('<div class="frames">')
    for frame in np.unique(np.linspace(0, len(clip) - 1, min(SHOWN, len(clip))).round().astype(int)).tolist():
        picture = over(clip.read(frame), labels.ids[frame], colours)
        height = max(1, round(_WIDTH * picture.shape[0] / picture.shape[1]))
        parts.append(
            f'<figure><img alt="" src="{_embedded(picture, (_WIDTH, height))}"><figcaption>frame '
            f"{escape(labels.frames[frame])}: {measured.masks[frame]:.0f} masks, "
            f"{measured.coverage[frame]:.0%} covered</figcaption></figure>"
        )
    parts.append(f"</div><h2>Over time</h2>{_curves(measured)}<h2>Objects</h2>")
    parts.append(_table(clip, labels, colours, namer(labels.vectors)))
    return "".join([*parts, "</body></html>\n"]).encode(), measured


def over(
    image: UInt8[np.ndarray, "H W 3"], ids: UInt16[np.ndarray, "H W"], colours: UInt8[np.ndarray, "M 3"]
) -> UInt8[np.ndarray, "H W 3"]:
    """A photo under its objects' colours, borders drawn; nobody's pixels stay grey.

    Args:
        colours: row n of id n; that of 0 is not looked at.
    """
    grey = image.mean(-1, keepdims=True)
    mixed = (1 - _HELD) * grey + _HELD * colours[ids]
    shown = np.where((ids > 0)[..., None], mixed, 0.6 * grey)
    border = np.zeros(ids.shape, bool)
    border[:, 1:] |= ids[:, 1:] != ids[:, :-1]
    border[1:] |= ids[1:] != ids[:-1]
    shown[border] = 255
    return shown.round().astype(np.uint8)


def _sentence(labels: ClipLabels, measured: Quality) -> str:
    seconds = labels.seconds.get("total", 0.0)
    pace = f", {len(labels.frames) / seconds:.2f} frames a second" if seconds else ""
    steady = measured.steady[1:].mean() if len(measured.steady) > 1 else 1.0
    return (
        f"{len(labels.objects)} objects in {len(labels.frames)} frames: {measured.masks.mean():.1f} masks "
        f"a frame, {measured.coverage.mean():.0%} of the pixels covered, "
        f"{steady:.1%} of them steady along the motion "
        f"from frame to frame{pace}."
    )


def _curves(measured: Quality) -> str:
    """Coverage and steadiness as lines from 0 to 1 over the frames, masks as their count."""
    width, height, left = 1000, 150, 52
    count = max(len(measured.masks) - 1, 1)
    most = max(float(measured.masks.max(initial=1)), 1)
    lines = []
    for values, colour, word in (
        (measured.coverage, "#2f6fb0", "covered"),
        (measured.steady, "#2a9d5c", "steady"),
        (measured.masks / most, "#d37a1f", f"masks (most: {most:.0f})"),
    ):
        points = " ".join(
            f"{left + (width - left) * n / count:.1f},{height * (1 - value) + 10:.1f}"
            for n, value in enumerate(values)
        )
        lines.append(f'<polyline fill="none" stroke="{colour}" stroke-width="2" points="{points}"/>')
        x = left + 10 + 160 * len(lines)
        lines.append(f'<text x="{x}" y="{height + 36}" fill="{colour}" font-size="14">{word}</text>')
    for share in (0, 0.5, 1):
        y = height * (1 - share) + 10
        lines.append(f'<line x1="{left}" x2="{width}" y1="{y}" y2="{y}" stroke="#8885"/>')
        lines.append(f'<text x="4" y="{y + 5}" fill="currentColor" font-size="13">{share:.0%}</text>')
    return f'<svg viewBox="0 0 {width} {height + 46}" role="img">{"".join(lines)}</svg>'


def _table(clip: Clip, labels: ClipLabels, colours: np.ndarray, names: Sequence[str]) -> str:
    heading = "".join(
        f"<th>{word}</th>" for word in ("", "", "called", "first seen", "frames", "of a frame", "agreement")
    )
    rows = []
    size = labels.ids[0].size if len(labels.ids) else 1
    areas = np.stack([np.bincount(ids.ravel(), minlength=len(labels.objects) + 1) for ids in labels.ids])
    largest = areas.argmax(0).tolist()
    for row, name in zip(labels.objects, names, strict=True):
        rgb = ",".join(str(value) for value in colours[row.id].tolist())
        numbers = (
            labels.frames[row.first],
            row.frames,
            f"{row.area / max(row.frames, 1) / size:.1%}",
            f"{row.agreement:.2f}",
        )
        cells = "".join(f'<td class="number">{escape(str(value))}</td>' for value in numbers)
        rows.append(
            f'<tr><td><span class="swatch" style="background:rgb({rgb})"></span> {row.id}</td>'
            f'<td><img alt="" loading="lazy" src="{_cut_out(clip, labels, row.id, largest[row.id])}"></td>'
            f"<td>{escape(name)}</td>{cells}</tr>"
        )
    return (
        f"<table><thead><tr>{heading}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
        '<p class="soft">Agreement: mean cosine of an object\'s vectors with their sum, over the frames '
        "where it was embedded. Called: the phrase of the vocabulary that is nearest to the sum.</p>"
    )


def _cut_out(clip: Clip, labels: ClipLabels, id: int, frame: int) -> str:
    """The object in a frame, on a dimmed photo."""
    own = labels.ids[frame] == id
    rows, columns = np.flatnonzero(own.any(1)), np.flatnonzero(own.any(0))
    image = np.where(own[..., None], clip.read(frame), clip.read(frame) // 3)
    cut = image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    ratio = _CUT / max(cut.shape[:2])
    return _embedded(cut, (max(1, round(cut.shape[1] * ratio)), max(1, round(cut.shape[0] * ratio))))


def as_jpeg(picture: UInt8[np.ndarray, "H W 3"], size: tuple[int, int]) -> bytes:
    """At a size (width, height)."""
    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(picture)).resize(size).save(stream, "JPEG", quality=82)
    return stream.getvalue()


def _embedded(picture: np.ndarray, size: tuple[int, int]) -> str:
    return "data:image/jpeg;base64," + base64.b64encode(as_jpeg(picture, size)).decode()
