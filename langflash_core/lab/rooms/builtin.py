"""Models made here: things a home has and the catalogues lack. Metres, y up, front +z.

Pictures, mirrors, rugs, curtains, cushions, blankets and books are boxes and cloths whose look comes
from the shader (`KIND_*`) and from each instance's own seed and tint.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from langflash_core.lab.rooms.catalogue import Item
from langflash_core.lab.rooms.objfile import Material, Soup, smooth_normals
from langflash_core.lab.rooms.solids import box, grid_triangles

KIND_PLAIN, KIND_ART, KIND_RUG, KIND_FABRIC, KIND_MIRROR = 0, 1, 2, 3, 4
LIBRARY = "builtin"


@dataclass(frozen=True)
class Builtin:
    """An item, its triangles and, per material name, look and shader kind."""

    item: Item
    soup: Soup
    materials: dict[str, tuple[Material, int]]


def builtin_models() -> tuple[Builtin, ...]:
    """Every model made here."""
    return (
        _framed("picture", ("painting", "wall art"), (0.60, 0.45), KIND_ART, "picture"),
        _framed("picture", ("painting", "poster"), (0.45, 0.62), KIND_ART, "picture"),
        _framed("painting", ("picture", "wall art"), (1.10, 0.70), KIND_ART, "picture"),
        _framed("mirror", ("wall mirror",), (0.55, 0.85), KIND_MIRROR, "mirror"),
        _framed("mirror", ("wall mirror",), (0.90, 0.70), KIND_MIRROR, "mirror"),
        _flat("rug", ("carpet",), (1.70, 0.012, 1.20), KIND_RUG, "rug"),
        _flat("rug", ("carpet",), (2.40, 0.012, 1.70), KIND_RUG, "rug"),
        _curtain("curtain", (1.0, 2.3)),
        _cushion("cushion", ("pillow",), (0.45, 0.16, 0.42)),
        _cushion("pillow", ("cushion",), (0.62, 0.14, 0.42)),
        _flat("blanket", ("throw",), (1.0, 0.03, 0.7), KIND_FABRIC, "blanket"),
        _books("book", (), (0.17, 0.030, 0.24), 1),
        _books("books", ("stack of books",), (0.19, 0.13, 0.26), 4),
        _books("magazine", (), (0.21, 0.008, 0.29), 1),
        _window("window", (1.20, 1.25), 0.90, 2),
        _window("window", (0.80, 1.30), 0.85, 1),
        _window("french window", (1.50, 2.12), 0.0, 2),
        _door((0.88, 2.05)),
    )


def _item(
    name: str,
    tags: tuple[str, ...],
    group: str,
    size: tuple[float, float, float],
    copy: str,
    elevation: float = 0.0,
) -> Item:
    opening = group in {"window", "door"}
    return Item(
        key=f"{name}-{copy}|{LIBRARY}",
        library=LIBRARY,
        name=name,
        tags=tags,
        category="Builtin",
        group=group,
        size=size,
        elevation=elevation,
        surface=-1.0,
        opening=opening,
        wall_front=0.8,
        light=False,
        rotation=tuple(np.eye(3).ravel()),
        creator="LangFlash",
        model="",
    )


def _soup(
    parts: list[tuple[Float[np.ndarray, "F 3 3"], int]], names: tuple[str, ...], uv_axes: tuple[int, int]
) -> Soup:
    positions = np.concatenate([p for p, _ in parts])
    materials = np.concatenate([np.full(len(p), m) for p, m in parts])
    flat = positions.reshape(-1, 3)
    low, high = flat.min(0), flat.max(0)
    unit = (positions - low) / np.maximum(high - low, 1e-9)
    return Soup(positions, smooth_normals(positions), unit[..., list(uv_axes)], materials, names)


def _framed(name: str, tags: tuple[str, ...], face: tuple[float, float], kind: int, group: str) -> Builtin:
    width, height = face
    size, bar = (width, height, 0.03), 0.035
    frame = [
        (box((width, bar, 0.03), (0, bar / 2, 0)), 0),
        (box((width, bar, 0.03), (0, height - bar / 2, 0)), 0),
        (box((bar, height - 2 * bar, 0.03), (-width / 2 + bar / 2, height / 2, 0)), 0),
        (box((bar, height - 2 * bar, 0.03), (width / 2 - bar / 2, height / 2, 0)), 0),
        (box((width - 2 * bar, height - 2 * bar, 0.012), (0, height / 2, -0.006)), 1),
    ]
    looks = {
        "frame": (Material((0.35, 0.27, 0.2), gloss=0.2), KIND_PLAIN),
        "face": (Material((0.8, 0.8, 0.8), gloss=0.5), kind),
    }
    return Builtin(
        _item(name, tags, group, size, f"{width:.2f}"), _soup(frame, ("frame", "face"), (0, 1)), looks
    )


def _flat(
    name: str, tags: tuple[str, ...], size: tuple[float, float, float], kind: int, group: str
) -> Builtin:
    body = [(box(size, (0, size[1] / 2, 0)), 0)]
    looks = {"cloth": (Material((0.75, 0.72, 0.68)), kind)}
    return Builtin(_item(name, tags, group, size, f"{size[0]:.2f}"), _soup(body, ("cloth",), (0, 2)), looks)


def _curtain(name: str, face: tuple[float, float]) -> Builtin:
    width, height = face
    x = np.linspace(-0.5, 0.5, 49)
    rows = np.linspace(0.0, 1.0, 7)
    depth = 0.05 * np.sin(x * 2 * np.pi * 6.0)[None] * (0.6 + 0.4 * (1 - rows))[:, None]
    grid = np.stack(np.broadcast_arrays(x[None] * width, rows[:, None] * height, depth), axis=-1)
    cloth = grid_triangles(grid)
    looks = {"cloth": (Material((0.8, 0.78, 0.74)), KIND_FABRIC)}
    return Builtin(
        _item(name, ("drapes",), "curtain", (width, height, 0.10), "1"),
        _soup([(cloth, 0)], ("cloth",), (0, 1)),
        looks,
    )


def _cushion(name: str, tags: tuple[str, ...], size: tuple[float, float, float]) -> Builtin:
    u = np.linspace(-1, 1, 13)
    x, z = np.meshgrid(u, u)
    bulge = ((1 - x**4) * (1 - z**4)) ** 0.5
    pinch = 1 - 0.10 * (1 - np.abs(x * z))
    top = np.stack([x * pinch * size[0] / 2, size[1] / 2 * (1 + bulge), z * pinch * size[2] / 2], axis=-1)
    bottom = top * [1, -1, 1] + [0, size[1], 0]
    looks = {"cloth": (Material((0.75, 0.72, 0.7)), KIND_FABRIC)}
    body = np.concatenate([grid_triangles(top), grid_triangles(bottom)])
    return Builtin(_item(name, tags, "cushion", size, "1"), _soup([(body, 0)], ("cloth",), (0, 2)), looks)


def _books(name: str, tags: tuple[str, ...], size: tuple[float, float, float], count: int) -> Builtin:
    rng = np.random.default_rng(count)
    parts, thick = [], size[1] / count
    for k in range(count):
        shrink = 1.0 if count == 1 else rng.uniform(0.75, 1.0)
        width, depth = size[0] * shrink, size[2] * shrink
        shift = (
            rng.uniform(-1, 1) * (size[0] - width) / 2,
            (k + 0.5) * thick,
            rng.uniform(-1, 1) * (size[2] - depth) / 2,
        )
        parts.append((box((width, thick, depth), shift), k))
        parts.append(
            (
                box(
                    (width * 0.99, thick * 0.7, depth * 1.004), (shift[0] + width * 0.01, shift[1], shift[2])
                ),
                count,
            )
        )
    colours = [(0.55, 0.16, 0.14), (0.14, 0.25, 0.42), (0.75, 0.68, 0.5), (0.2, 0.36, 0.25)]
    looks = {f"cover{k}": (Material(colours[k], gloss=0.15), KIND_PLAIN) for k in range(count)}
    looks["pages"] = (Material((0.93, 0.91, 0.85)), KIND_PLAIN)
    return Builtin(_item(name, tags, "book", size, str(count)), _soup(parts, tuple(looks), (0, 2)), looks)


def _window(name: str, face: tuple[float, float], elevation: float, sashes: int) -> Builtin:
    """A frame, sashes with a cross bar each, and a handle; no glass."""
    width, height = face
    bar, depth = 0.06, 0.12
    parts = [(box((width, bar, depth), (0, y, 0)), 0) for y in (bar / 2, height - bar / 2)]
    posts = np.linspace(-width / 2 + bar / 2, width / 2 - bar / 2, sashes + 1)
    parts += [(box((bar, height - 2 * bar, depth), (x, height / 2, 0)), 0) for x in posts]
    for left, right in itertools.pairwise(posts):
        parts.append((box((right - left - bar, 0.03, 0.04), ((left + right) / 2, height * 0.62, -0.02)), 0))
    parts.append(
        (
            box(
                (0.02, 0.12, 0.03),
                (posts[-1] - 0.02 if sashes == 1 else posts[1], height * 0.45, depth / 2 + 0.01),
            ),
            1,
        )
    )
    looks = {
        "frame": (Material((0.92, 0.92, 0.9), gloss=0.2), KIND_PLAIN),
        "handle": (Material((0.6, 0.6, 0.6), gloss=0.6), KIND_PLAIN),
    }
    item = _item(name, ("pane",), "window", (width, height, depth + 0.02), f"{width:.2f}", elevation)
    return Builtin(item, _soup(parts, ("frame", "handle"), (0, 1)), looks)


def _door(face: tuple[float, float]) -> Builtin:
    width, height = face
    parts = [
        (box((0.07, height, 0.10), (x, height / 2, 0)), 0) for x in (-width / 2 + 0.035, width / 2 - 0.035)
    ]
    parts += [(box((width - 0.14, 0.07, 0.10), (0, height - 0.035, 0)), 0)]
    parts += [(box((width - 0.14, height - 0.07, 0.04), (0, (height - 0.07) / 2, 0)), 1)]
    for y, tall in ((0.5, 0.7), (1.4, 0.8)):
        parts.append((box((width * 0.55, tall, 0.06), (0, y, 0)), 1))
    parts.append((box((0.13, 0.025, 0.14), (width / 2 - 0.16, 1.02, 0)), 2))
    looks = {
        "frame": (Material((0.88, 0.86, 0.82), gloss=0.1), KIND_PLAIN),
        "leaf": (Material((0.90, 0.88, 0.84), gloss=0.15), KIND_PLAIN),
        "handle": (Material((0.55, 0.53, 0.5), gloss=0.7), KIND_PLAIN),
    }
    return Builtin(
        _item("door", (), "door", (width, height, 0.14), "1"), _soup(parts, tuple(looks), (0, 1)), looks
    )
