"""Photos that no scene is in, or that deceive, through the whole path, in every precision.

    python -m tests.torture photos [--only noise ...]

Every set becomes a scene whose numbers are finite and in their range, which answers a phrase; or one sentence
that says why not. The learned stages before the first decision (tokens, depth of each photo, language, masks)
are compared with the same network in float64; what follows decides (which matches agree, which groups are
there), so equal inputs are needed for equal outputs and a difference there says nothing.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import torch
from torch.nn import functional as F

from langflash_core import pipeline
from langflash_core.base.resources import asset_path
from langflash_core.errors import LangFlashError
from langflash_core.images.views import load_views
from langflash_core.network import GuidedDepthNet, load_network
from langflash_core.types import Scene
from tests.torture.rows import Row

SIZE = 112  # about which the network sees, pixels a side
WIDTH, HEIGHT = 320, 240
PRECISIONS = ("float32", "bfloat16")
BOUNDS = {
    "float32": {"tokens": 2e-5, "depth": 2e-6, "language": 1e-11, "masks": 1e-5},
    "bfloat16": {"tokens": 0.05, "depth": 0.01, "language": 1e-3, "masks": 0.05},
}
"""Largest error beside float64: tokens and masks as a share of their mean square, root taken; depth as the
mean of |log d - log d64|; language as the mean of 1 - cosine. Some five times what was measured."""
Picture = np.ndarray


@dataclass(frozen=True)
class Hard:
    """photos: (H, W, 3) uint8 each. fov: degrees that are said. none: whether no scene may come of it."""

    name: str
    photos: tuple[Picture, ...]
    fov: float | None = None
    none: bool = False


def photo(name: str) -> Picture:
    """A shipped one, small."""
    picture = cv2.imread(str(asset_path(f"photos/{name}")), cv2.IMREAD_COLOR)
    assert picture is not None
    return cv2.resize(picture, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)


def sets() -> list[Hard]:
    """All of them, made here."""
    rng = np.random.default_rng(0)
    left, right = photo("living_room_left.png"), photo("living_room_right.png")
    other = photo("books_left.jpg")
    flat = np.full_like(left, 128)
    noise = [rng.integers(0, 256, left.shape, np.uint8) for _ in range(2)]
    burst = [_noisy(left, 4, rng) for _ in range(5)]
    wide = np.concatenate((left, left[:, ::-1]) * 4, axis=1)
    return [
        Hard("constant", (flat, flat + 3), none=True),
        Hard("noise", (noise[0], noise[1])),
        Hard("mirror", (left, np.ascontiguousarray(left[:, ::-1]))),
        Hard("identical", (left, left)),
        Hard("swapped", (right, left)),
        Hard("turned by 90 degrees", (left, np.ascontiguousarray(np.rot90(right)))),
        Hard("no overlap", (left, other)),
        Hard("black", (flat * 0, flat * 0), none=True),
        Hard("white", (flat * 0 + 255, flat * 0 + 255), none=True),
        Hard("black and a photo", (flat * 0, right)),
        Hard("far too dark", tuple((p * 0.03).astype(np.uint8) for p in (left, right))),
        Hard("far too bright", tuple((p * 20.0).clip(0, 255).astype(np.uint8) for p in (left, right))),
        Hard("seen through a straw", (left, right), fov=2.0),
        Hard("seen by a fish", (left, right), fov=165.0),
        Hard("panoramas", (wide, np.roll(wide, 90, axis=1))),
        Hard("a burst", tuple(burst)),
        Hard("text only", tuple(_text(shift) for shift in (0, 9))),
        Hard("a screen", (_screen(left, 3), _screen(right, 4))),
        Hard("one pixel wide stripes", (_stripes(0), _stripes(1)), none=True),  # one grey, as it is seen
        Hard("one photo", (left,)),
    ]


def _noisy(picture: Picture, by: float, rng: np.random.Generator) -> Picture:
    return (picture + rng.normal(0, by, picture.shape)).clip(0, 255).astype(np.uint8)


def _text(shift: int) -> Picture:
    page = np.full((HEIGHT, WIDTH, 3), 255, np.uint8)
    for line in range(14):
        words = "nothing but words on a page, and more words"[line % 7 :]
        cv2.putText(page, words, (8 + shift, 18 + 16 * line), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1)
    return page


def _screen(picture: Picture, pitch: int) -> Picture:
    """A picture of a screen: a dark frame, and lines that beat with the pixels."""
    shown = picture.copy()
    shown[::pitch] //= 3
    shown[:, ::pitch, 1:] //= 2
    shown[:20] = shown[-20:] = shown[:, :20] = shown[:, -20:] = 12
    return shown


def _stripes(phase: int) -> Picture:
    columns = ((np.arange(WIDTH) + phase) % 2 * 255).astype(np.uint8)
    return np.broadcast_to(columns[None, :, None], (HEIGHT, WIDTH, 3)).copy()


def judged(hard: Hard, folder: Path, precision: str, twin: Callable[[list[Path]], "Stages"]) -> Row:
    """One set in one precision; twin: gives the stages in float64."""
    row, paths = Row(f"{hard.name}, {precision}"), written(hard, folder)
    made(hard, paths, row, precision)
    errors, bounds = beside(stages(paths, precision), twin(paths)), BOUNDS[precision]
    row.told = "; ".join([*(f"{name} {error:.1e}" for name, error in errors.items()), row.told[:90]])
    row.finds += [f"{n}: {e:.2g} > {bounds[n]}" for n, e in errors.items() if not e <= bounds[n]]
    return row


def written(hard: Hard, folder: Path) -> list[Path]:
    """Its photos as files."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{hard.name.replace(' ', '_')}_{n}.png" for n in range(len(hard.photos))]
    for path, picture in zip(paths, hard.photos, strict=True):
        cv2.imwrite(str(path), picture)
    return paths


def made(hard: Hard, paths: list[Path], row: Row, precision: str = "float32") -> Scene | None:
    """The scene, or None where none came of it; what is wrong with that goes into the row."""
    try:
        scene = pipeline.reconstruct(paths, fov=hard.fov, size=SIZE, precision=precision, detail="low")
    except LangFlashError as error:
        row.told = str(error)
        if "\n" in row.told or not hard.none:
            row.finds.append(f"refused: {row.told}")
        return None
    except Exception as error:
        row.finds.append(f"{type(error).__name__}: {error}")
        return None
    row.told = f"{len(scene.gaussians):,} Gaussians, {scene.semantics.num_atoms} groups"
    if hard.none:
        row.finds.append(f"a scene of nothing: {row.told}")
    row.finds += _wrong(scene)
    return scene


def _wrong(scene: Scene) -> Iterator[str]:
    """What of a scene is not finite, or out of its range."""
    g, s = scene.gaussians, scene.semantics
    tensors = {"means": g.means, "quats": g.quats, "scales": g.scales, "opacities": g.opacities, "sh": g.sh}
    tensors |= {
        "weights": s.weight_values,
        "dictionary": s.dictionary,
        "poses": scene.viewmats,
        "K": scene.Ks,
    }
    yield from (f"{name} is not finite" for name, values in tensors.items() if not values.isfinite().all())
    if len(g) == 0:
        yield "a scene without Gaussians"
        return
    if not ((g.opacities >= 0) & (g.opacities <= 1)).all() or not (g.scales > 0).all():
        yield "an opacity or a size out of its range"
    if not torch.allclose(g.quats.norm(dim=-1), torch.ones(len(g)), atol=1e-4):
        yield "a turn that is no turn"
    turns = scene.viewmats[:, :3, :3].double()
    if not torch.allclose(turns @ turns.mT, torch.eye(3).double().expand_as(turns), atol=1e-4):
        yield "a pose that is no pose"
    if s.num_atoms:
        total = s.weight_values.float().sum(-1)
        if not torch.allclose(total, torch.ones_like(total), atol=1e-3):
            yield f"weights sum to {float(total.min()):.3f}"
        if not torch.allclose(s.dictionary.float().norm(dim=-1), torch.ones(s.num_atoms), atol=1e-3):
            yield "an atom that is no unit vector"
        found = pipeline.query(scene, ["plant"])
        if not found.relevance.isfinite().all():
            yield "relevance is not finite"


# --- beside float64 -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Stages:
    """tokens: the encoder's last. depth: log, of each photo by itself. language: unit vectors. masks: the map
    that masks are read from."""

    tokens: torch.Tensor
    depth: torch.Tensor
    language: torch.Tensor
    masks: torch.Tensor


@torch.inference_mode()
def stages(paths: list[Path], precision: str) -> Stages:
    """Of float32, bfloat16 or float64."""
    network, kind = _network(precision), torch.float64 if precision == "float64" else torch.float32
    views = load_views(paths, area=SIZE * SIZE)
    images, Ks = views.images[None].to(kind), views.Ks[None].to(kind)
    tokens = network.encode(images, Ks)
    depth = network.monocular_depth(tokens, Ks).log_depths
    language = network.language(tokens, images)
    _, masks = network.semantic_maps(tokens, images)
    return Stages(tokens.hooks[-1], depth, language, masks)


@cache
def _network(precision: str) -> GuidedDepthNet:
    network = load_network("mini", bfloat16=precision == "bfloat16")
    assert isinstance(network, GuidedDepthNet)
    if precision == "float64":
        network.to(torch.float64)
        for part in network.modules():  # some stages go back to float32 by themselves
            part.register_forward_pre_hook(lambda _, given: tuple(map(_double, given)))
    return network


def _double(value: object) -> object:
    single = isinstance(value, torch.Tensor) and value.dtype == torch.float32
    return value.double() if single else value  # type: ignore[union-attr]


def beside(found: Stages, truth: Stages) -> dict[str, float]:
    """Errors, as `BOUNDS` has them."""

    def share(a: torch.Tensor, b: torch.Tensor) -> float:
        return float(((a.double() - b).square().mean() / b.square().mean()).sqrt())

    cosine = F.cosine_similarity(found.language.double(), truth.language.double(), dim=2)
    return {
        "tokens": share(found.tokens, truth.tokens),
        "depth": float((found.depth.double() - truth.depth).abs().mean()),
        "language": float((1 - cosine).mean()),
        "masks": share(found.masks, truth.masks),
    }


def everything(folder: Path, only: list[str] | None = None) -> Iterator[Row]:
    """Every set in every precision."""
    for hard in sets():
        if only and not any(hard.name.startswith(name) for name in only):
            continue
        known: list[Stages] = []

        def twin(paths: list[Path], known: list[Stages] = known) -> Stages:
            if not known:
                known.append(stages(paths, "float64"))
            return known[0]

        for precision in PRECISIONS:
            yield judged(hard, folder, precision, twin)
