"""Pictures drawn on the processor, by threads of Python, for machines without a graphics card.

There OpenGL runs on the processor too, on the thread of its context, and weight maps cost it twice the
colours. `langflash_core/splat/tiles.py` composites colours and all weights in one product: more work, but any
thread may do it, so that no frame waits. A renderer takes the result (`SplatRenderer.bring`) and shows it
like its own.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count
from threading import Lock

import numpy as np
import torch
from torch import Tensor

from langflash_core.errors import Cancelled
from langflash_core.geometry.nearness import NEAREST, Nearness
from langflash_core.language.relevance import CompiledQuery
from langflash_core.language.settings import RELEVANCE
from langflash_core.splat.compose import shares
from langflash_core.splat.frustum import may_touch
from langflash_core.splat.projection import (
    ALPHA_MIN,
    NEAR,
    Footprints,
    drawable_rows,
    project,
    view_colours,
)
from langflash_core.splat.tiles import rasterize_tiles
from langflash_core.types import LUMA, Camera, Frame, Gaussians, Scene

from ..answers import in_numbers, temperature_of
from ..splats import TINTED, TINTS
from ..targets import mean_depths
from .host import relevancy

_PIXELS_AT_ONCE = 1 << 13  # 1.3 MB of 40 weights: within a core's cache
_AT_ONCE = 1_000_000  # Gaussians that are projected; some 500 MB
_KEPT = 4  # answers of a picture, the newest
_HALF_MAX = 65504.0
_names = count(1)


@dataclass(frozen=True)
class StillMaps:
    """Weight maps (H, W, K) float16 of one still picture, and what was made of them."""

    weights: Tensor = field(repr=False)
    _made: dict[tuple, np.ndarray] = field(default_factory=dict, repr=False, compare=False)
    _lock: Lock = field(default_factory=Lock, repr=False, compare=False)

    def pixel(self, x: int, y: int) -> np.ndarray:
        """(K,) float32 of one pixel."""
        return self.weights[y, x].float().numpy()

    def relevance(self, compiled: CompiledQuery) -> np.ndarray:
        """(P, H, W) float32; computed once for a question, 1 / |F| once for all questions of a dictionary."""
        return self._kept(_name(compiled), lambda: self._relevance(compiled))

    def answers(self, compiled: CompiledQuery) -> bool:
        """Whether the relevance is there already."""
        return _name(compiled) in self._made

    def mixes(self, columns: np.ndarray) -> bool:
        """Whether the mixture of these columns is there already."""
        return ("mixed", np.ascontiguousarray(columns, np.float32).tobytes()) in self._made

    def mixed(self, columns: np.ndarray) -> np.ndarray:
        """sum_k W_k c_k, (H, W, n) float32, for columns c (K, n); computed once for these."""
        table = np.ascontiguousarray(columns, np.float32)
        height, width = self.weights.shape[:2]

        def mix() -> np.ndarray:
            return np.ascontiguousarray(self._products(table).T).reshape(height, width, -1)

        return self._kept(("mixed", table.tobytes()), mix)

    def _products(self, table: np.ndarray) -> np.ndarray:
        """(W T)^T (n, H W) float32 for a table T (K, n)."""
        columns = torch.from_numpy(np.ascontiguousarray(table.T, np.float32))
        return torch.cat([columns @ part.T for part in self._parts()], 1).numpy()

    def _parts(self) -> Iterator[Tensor]:
        """Weights (n, K) float32 of some pixels at a time."""
        return (part.float() for part in self.weights.flatten(0, 1).split(_PIXELS_AT_ONCE))

    def _relevance(self, compiled: CompiledQuery) -> np.ndarray:
        """As `relevance_maps`, by W (R t) in float32: the vectors W R are formed for their norms alone."""
        factor, prompts, negatives = in_numbers(compiled)
        inverse = self._kept(("norms", factor.tobytes()), lambda: self._inverse_norms(factor))
        cosines = self._products(factor @ np.concatenate((prompts, negatives)).T)  # (P + M, H W)
        cosines *= inverse
        np.clip(cosines, -1, 1, out=cosines)
        answers, against = cosines[: len(prompts)], cosines[len(prompts) :]
        temperature = temperature_of(compiled)
        if temperature > 0:
            worst = np.where(inverse > 0, against.max(0), np.float32(np.inf))
            for answer in answers:
                relevancy(answer, worst, temperature)
        return answers.reshape(-1, *self.weights.shape[:2]).copy()  # the negatives go

    def _inverse_norms(self, factor: np.ndarray) -> np.ndarray:
        """1 / |W R| (H W,) float32; 0 where |W R| is below `RELEVANCE.empty_norm`."""
        columns = torch.from_numpy(np.ascontiguousarray(factor.T, np.float32))
        norms = torch.cat([(columns @ part.T).square_().sum(0).sqrt_() for part in self._parts()]).numpy()
        return np.divide(1, norms, out=np.zeros_like(norms), where=norms >= RELEVANCE.empty_norm)

    def _kept(self, key: tuple, make: Callable[[], np.ndarray]) -> np.ndarray:
        made = self._made.get(key)
        if made is None:
            made = make()
        with self._lock:  # the artist makes, the window reads; what is asked for stays longest
            self._made.pop(key, None)
            while len(self._made) >= _KEPT:
                self._made.pop(next(iter(self._made)))
            self._made[key] = made
        return made


def _name(compiled: CompiledQuery) -> tuple:
    """Of a question: all that its answer depends on."""
    tensors = (compiled.factor, compiled.prompts, compiled.negatives)
    return (*(t.detach().cpu().numpy().tobytes() for t in tensors), compiled.temperature, compiled.mode)


@dataclass(frozen=True)
class Still:
    """One picture. colour: (H, W, 4) float16, premultiplied, with alpha. depth: (H, W, 2) float32, sums of
    T alpha z and of T alpha. maps: None where nobody asked for them. `key` names its content."""

    camera: Camera
    colour: np.ndarray = field(repr=False)
    depth: np.ndarray = field(repr=False)
    depth_range: tuple[float, float]
    maps: StillMaps | None
    key: int = field(default_factory=lambda: -next(_names))  # below those of what OpenGL draws

    @cached_property
    def frame(self) -> Frame:
        """The picture over black as tensors, without its weight maps."""
        rgb = torch.from_numpy(self.colour[..., :3].astype(np.float32))
        depths = torch.from_numpy(mean_depths(self.depth, ALPHA_MIN))
        return Frame(rgb, torch.from_numpy(self.depth[..., 1].copy()), depths, None)


def mixture(still: Still, columns: np.ndarray) -> np.ndarray:
    """Colours (H, W, 3) that columns (K, 3 or 4) of the atoms mix to: as show_atoms.frag, and where a fourth
    column counts the weights, as show_features.frag."""
    assert still.maps is not None
    mixed = still.maps.mixed(columns)
    if columns.shape[1] == 3:
        return mixed
    weights = mixed[..., 3:]
    return np.where(weights >= ALPHA_MIN, mixed[..., :3] / np.maximum(weights, 1e-6), 0.0)


def draw_still(
    scene: Scene,
    camera: Camera,
    *,
    marks: tuple[np.ndarray, np.ndarray] | None = None,
    weight_maps: bool = True,
    most: int = NEAREST,
    threads: int = 1,
    stopping: Callable[[], bool] = lambda: False,
) -> Still:
    """Draw a scene as `SplatRenderer.draw` does.

    Args:
        most: layers that are blended, of a scene of layers.
        marks: shown (N,) bool and tints (N,) uint8, as `SplatRenderer.mark` takes them.
        threads, stopping: as `rasterize_tiles`.

    Raises:
        Cancelled: `stopping` said so.
    """

    order = _Order(scene, camera, marks, weight_maps, threads, stopping)
    chosen = Nearness.of(scene).chosen(camera, most) if scene.layered else None
    kept = order.kept()
    if chosen is None or not chosen.views:
        drawn = order.splatted(kept)
    else:
        assert scene.view_ids is not None
        ids = scene.view_ids.cpu()
        layers = [order.splatted(kept & ((ids == view) | (ids < 0))) for view in chosen.views]
        drawn = layers[0] if len(layers) == 1 else _blended(layers, chosen.weights)
    colour = torch.cat((drawn.colours[..., :3], drawn.alphas[..., None]), -1).half().numpy()
    depth = torch.stack((drawn.colours[..., 3], drawn.alphas), -1).numpy()
    still = None if drawn.maps is None else StillMaps(drawn.maps)
    return Still(camera, colour, depth, drawn.depth_range or (NEAR, 1.0), still)


@dataclass(frozen=True)
class _Splatted:
    """colours: (H, W, 4) float32, premultiplied, and the sum of T alpha z. alphas: (H, W). maps: (H, W, F)
    float16. depth_range: as `Still` has it; None where nothing is in view."""

    colours: Tensor
    alphas: Tensor
    maps: Tensor | None
    depth_range: tuple[float, float] | None


@dataclass(frozen=True)
class _Order:
    """What `draw_still` is to draw; Gaussians of it are splatted together by `splatted`."""

    scene: Scene
    camera: Camera
    marks: tuple[np.ndarray, np.ndarray] | None
    weight_maps: bool
    threads: int
    stopping: Callable[[], bool]

    def kept(self) -> Tensor:
        """(N,) bool, of the Gaussians that may touch the picture, are to be shown and can be drawn."""
        kept = torch.from_numpy(may_touch(self.scene.gaussians, self.camera))
        if self.marks is not None:
            kept &= torch.from_numpy(self.marks[0])
        for rows in kept.nonzero()[:, 0].split(_AT_ONCE):
            self._go_on()
            kept[rows] = drawable_rows(self.scene.rows(rows))
        return kept

    def splatted(self, kept: Tensor) -> _Splatted:
        """A picture of some Gaussians (N,) bool.

        Raises:
            as `draw_still`.
        """
        gaussians = self.scene.gaussians.map(lambda v: v.detach()[kept])
        self._go_on()
        footprints = _footprints(gaussians, self.camera, self._go_on)
        colours = view_colours(gaussians, self.camera).float().clamp_max(_HALF_MAX)
        if self.marks is not None:
            colours = _tinted(colours, torch.from_numpy(self.marks[1])[kept])
        depths = torch.zeros(len(gaussians)).index_copy(0, footprints.ids, footprints.depths.float())
        features = [torch.cat((colours, depths[:, None]), -1)]
        if self.weight_maps:
            semantics = self.scene.semantics.rows(kept)
            half = semantics.weight_values.detach().half()  # before they are dense: no copy in full
            features.append(replace(semantics, weight_values=half).dense_weights())
            self._go_on()
        maps, alphas = rasterize_tiles(
            footprints, features, self.camera, threads=self.threads, stopping=self.stopping
        )
        return _Splatted(maps[0], alphas, maps[1] if self.weight_maps else None, _middle(footprints.depths))

    def _go_on(self) -> None:
        if self.stopping():
            raise Cancelled("the picture is no longer wanted")


def _blended(layers: list[_Splatted], weights: np.ndarray) -> _Splatted:
    """One picture of those of layers (langflash_core/splat/compose.py); its maps go into the first's."""
    alphas = torch.stack([layer.alphas for layer in layers])
    sums = torch.stack([layer.colours[..., 3] for layer in layers])
    b = shares(alphas, torch.where(alphas >= ALPHA_MIN, sums / alphas.clamp_min(ALPHA_MIN), 0.0), weights)
    colours = torch.zeros_like(layers[0].colours)
    for own, layer in zip(b, layers, strict=True):
        colours += own[..., None] * layer.colours
    maps = [layer.maps for layer in layers if layer.maps is not None]
    for row in range(len(alphas[0]) if maps else 0):  # of pixels, in float32: no picture twice
        mixed = torch.zeros(maps[0].shape[1:])
        for own, each in zip(b[:, row], maps, strict=True):
            mixed += own[:, None] * each[row]
        maps[0][row] = mixed
    ranges = [layer.depth_range for layer in layers if layer.depth_range is not None]
    seen = (min(near for near, _ in ranges), max(far for _, far in ranges)) if ranges else None
    return _Splatted(colours, (b * alphas).sum(0), maps[0] if maps else None, seen)


def _footprints(gaussians: Gaussians, camera: Camera, go_on: Callable[[], None]) -> Footprints:
    """As `project` in float64, some at a time: ten million at once take several GB beside themselves."""
    parts, starts = [], range(0, max(len(gaussians), 1), _AT_ONCE)
    for start in starts:
        rows = slice(start, start + _AT_ONCE)
        parts.append(project(gaussians.map(lambda v, rows=rows: v[rows].double()), camera))
        go_on()
    if len(parts) == 1:
        return parts[0]
    ids = torch.cat([part.ids + start for part, start in zip(parts, starts, strict=True)])
    depths = torch.cat([part.depths for part in parts])
    order = depths.argsort(stable=True)  # each part keeps the order of equal depths, and so do they
    centres, roots, opacities = (
        torch.cat([getattr(part, name) for part in parts])[order]
        for name in ("centres", "roots", "opacities")
    )
    dropped = sum(part.num_dropped for part in parts)
    return Footprints(ids[order], centres, roots, opacities, depths[order], dropped)


def _middle(depths: Tensor) -> tuple[float, float] | None:
    """Near and far (n,) of the middle 96 % of the Gaussians in view, nearest first; None of none."""
    if not len(depths):
        return None
    margin = len(depths) // 50
    return (float(depths[margin]), float(depths[-1 - margin]))


def _tinted(colours: Tensor, tints: Tensor) -> Tensor:
    """As project.vert: the tint in the colour's own brightness, mixed in."""
    table = torch.tensor(((0.0, 0.0, 0.0), *TINTS))
    grey = colours.clamp_max(1.0) @ torch.tensor(LUMA)
    wanted = table[tints.long()] * (0.35 + 0.75 * grey)[:, None]
    return torch.where((tints > 0)[:, None], torch.lerp(colours, wanted, TINTED), colours)
