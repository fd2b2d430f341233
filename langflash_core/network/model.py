"""A network whatever its geometry: photos in, `Prediction` out. Stages run once, in order, timed."""

import math
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from langflash_core.base.keeping import not_kept
from langflash_core.base.many import in_groups
from langflash_core.base.records import FoundFocal
from langflash_core.base.running import Kept, Progress, Run, evenly
from langflash_core.errors import WeightsError
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.presets import Preset
from langflash_core.network.semantics.aggregation import Aggregation, averaged_atoms
from langflash_core.network.semantics.grouping import Groups
from langflash_core.types import FoundLens, Gaussians, Prediction, Views

Atoms = Callable[[Tensor, Tensor], Tensor]
Lifted = Callable[["Geometry", Views], Tensor]
Redrawn = Callable[[Tensor, Views], Tensor]
MEANING_STAGES = ("language features", "grouping", "aggregation")


@dataclass(frozen=True)
class Geometry:
    """What the geometry stages hand over; fields as in `Prediction`."""

    gaussians: Gaussians
    viewmats: Float[Tensor, "V 4 4"]
    depths: Float[Tensor, "V H W"]
    confidences: Float[Tensor, "V H W"]
    unplaced: tuple[int, ...]
    Ks: Float[Tensor, "V 3 3"] | None = None
    lenses: tuple[FoundLens, ...] = ()
    warnings: tuple[str, ...] = ()
    bent: tuple[FoundFocal | None, ...] = ()

    @staticmethod
    def of_bent(lenses: tuple[FoundFocal | None, ...]) -> "Geometry":
        """Of photos that are to be straightened first."""
        none = torch.zeros(0, 0, 0)
        return Geometry(Gaussians.none(), torch.zeros(0, 4, 4), none, none, (), bent=lenses)


@dataclass(frozen=True)
class Seen:
    """What tells a part's name besides language features: images (V, 3, H, W) in [0, 1], tokens of the scene
    (B = 1), depths (V, H, W), viewmats (V, 4, 4) and Ks (V, 3, 3) of all its views; sources: the photos as
    `Views` has them, larger."""

    images: Float[Tensor, "V 3 H W"]
    tokens: Tokens
    depths: Float[Tensor, "V H W"]
    viewmats: Float[Tensor, "V 4 4"]
    Ks: Float[Tensor, "V 3 3"]
    sources: tuple[bytes, ...] = ()

    def pictures(self) -> Iterator[Float[Tensor, "1 3 _ _"]]:
        """The largest version of every photo at hand, one after the other, (1, 3, h, w) in [0, 1]."""
        if not self.sources:
            yield from self.images.split(1)
        for source in self.sources:
            pixels = cv2.imdecode(np.frombuffer(source, np.uint8), cv2.IMREAD_COLOR_RGB)
            assert pixels is not None, "they were read before"
            yield torch.from_numpy(pixels).to(self.images.device).permute(2, 0, 1)[None] / 255


class LangFlashNet(nn.Module):
    """What both kinds of geometry share: the order of stages, grouping, and the dictionary.

    A subclass builds its own parts and gives `encode`, `reconstruct`, `language`,
    `semantic_maps` and `parts`; every stage of training reads the network through these.
    """

    stages: tuple[str, ...]
    """Names of the timed steps, in order."""
    begins: Mapping[str, float] | None = None
    """Where each begins in the whole; None: they take equally long."""
    frozen: tuple[str, ...]
    """Parts that this project takes as they are and never trains."""
    compact: bool
    """Weights are stored as int8 rows; else as they are."""
    bfloat16_on_cpu: bool = True
    """A processor with instructions for bfloat16 takes it by itself: the time is worth the change."""
    surfaces: bool
    """Depth maps are surfaces, which elements of any size may cover; else Gaussians are what they are."""
    caches_tokens: bool
    """Training may read tokens from disk, because nothing that is trained changes them."""
    grouping: nn.Module
    aggregation: Aggregation
    trained_side: int
    """Pixels a side of the photos that the geometry was trained on, where that is known; 0: it is not."""
    notes: tuple[str, ...]
    """What whoever reads an answer should know of the weights."""

    def __init__(self, preset: Preset):
        super().__init__()
        self.preset = preset
        self.calibration: dict = {}
        self.trained_side = 0
        self.notes: tuple[str, ...] = ()

    @abstractmethod
    def use_bfloat16(self) -> "LangFlashNet":
        """Matrix products in bfloat16 wherever the network's rule allows it."""

    def compiled(self, backend: str = "inductor") -> "LangFlashNet":
        """Every part through torch.compile; the first pass of each size then takes minutes."""
        for part in self.children():
            part.compile(backend=backend)
        return self

    def complete(self, filled: set[str], remedy: str) -> None:
        """Settle what has no weights after those of `filled` were read.

        Raises:
            WeightsError: a module cannot do without; ends with `remedy`.
        """
        missing = [name for name, _ in self.named_children() if name not in filled]
        if missing:
            raise WeightsError(f"there are no weights for {', '.join(missing)}; {remedy}")

    @abstractmethod
    def encode(self, images: Float[Tensor, "B V 3 H W"], Ks: Float[Tensor, "B V 3 3"]) -> Tokens:
        """Shared tokens of images (B, V, 3, H, W) in [0, 1]; Ks (B, V, 3, 3) in their pixels."""

    @abstractmethod
    def reconstruct(
        self,
        views: Views,
        images: Float[Tensor, "B V 3 H W"],
        Ks: Float[Tensor, "B V 3 3"],
        tokens: Tokens,
        run: Run,
        elements: bool = True,
    ) -> Geometry:
        """The geometry stages of one scene (B = 1); elements: as `predict`."""

    @abstractmethod
    def language(self, tokens: Tokens, images: Float[Tensor, "B V 3 H W"]) -> Float[Tensor, "B V C h w"]:
        """L(x), (B, V, C, h, w), unit channel norm."""

    @abstractmethod
    def semantic_maps(
        self, tokens: Tokens, images: Float[Tensor, "B V 3 H W"]
    ) -> tuple[tuple[Float[Tensor, "n C _ _"], ...], Float[Tensor, "n C h w"]]:
        """What queries read, coarse to fine (B*V, f, h, w) each, and the map that masks are read from."""

    @abstractmethod
    def parts(
        self,
        tokens: Tokens,
        images: Float[Tensor, "B V 3 H W"],
        size: tuple[int, int],
        features: Float[Tensor, "B V C h w"] | None = None,
    ) -> Float[Tensor, "V J mh mw"]:
        """w_k(x) of one scene (B = 1), (V, K, *size), sums to 1 over K; features: of `language`."""

    def group(self, tokens: Tokens, images: Float[Tensor, "B V 3 H W"]) -> tuple[Groups, ...]:
        """Groups after each scale or layer; the last is the answer."""
        memories, finest = self.semantic_maps(tokens, images)
        return self.grouping(memories, finest, tokens.shape[1])

    grouped = True
    """The grouping has weights."""
    aggregated = True
    """The aggregation has weights; else atoms are plain averages."""

    def dictionary(
        self,
        weights: Float[Tensor, "V K H W"],
        features: Float[Tensor, "B V C h w"],
        seen: Seen | None = None,
    ) -> Float[Tensor, "K C"]:
        """Atoms (K, C) of unit norm of one scene: weights (V, K, H, W), features (1, V, C, h, w).

        seen: for networks that name parts by more than their language features.
        """
        small = pooled_weights(weights, features)
        if self.aggregated:
            atoms = self.aggregation(small, features)[0]
        else:
            atoms = averaged_atoms(small, features, self.preset.eps)[0]
        return atoms if seen is None else self.named(atoms, small[0], seen)

    def named(
        self, atoms: Float[Tensor, "K C"], weights: Float[Tensor, "V K h w"], seen: Seen
    ) -> Float[Tensor, "K C"]:
        """Atoms (K, C) of one scene, corrected by what is seen of their parts; weights (V, K, h, w)."""
        return atoms

    @contextmanager
    def stopping(self, check: Callable[[], None]) -> Iterator[None]:
        """Calls `check` before every layer, so that what it raises ends the work within one layer."""
        handles = [part.register_forward_pre_hook(lambda *_: check()) for part in self.modules()]
        try:
            yield
        finally:
            for handle in handles:
                handle.remove()

    @torch.inference_mode()
    def predict(
        self,
        views: Views,
        progress: Progress | None = None,
        cancelled: Callable[[], bool] | None = None,
        atoms: Atoms | None = None,
        groups: Lifted | None = None,
        redrawn: Redrawn | None = None,
        elements: bool = True,
        kept: Kept = not_kept,
    ) -> Prediction:
        """One scene from V photos of one size (sides multiples of the patch).

        Args:
            atoms: weights (V, K, H, W) and features (1, V, C, h, w) to atoms (K, C) of unit norm;
                None: `dictionary`, with all that was seen.
            groups: geometry and views to w_k(x), (V, K, H, W), sums to 1 over K; None: `parts`.
            redrawn: w_k(x) and views to finer ones of the same shape; None: they stay.
            kept: gives the results of long steps, those that were kept of an earlier run.
            elements: one Gaussian a pixel; without them `gaussians` is empty, where depth maps say it all
                (`surfaces`), and networks without surfaces make them all the same.

        Raises:
            Cancelled: `cancelled()` became true; asked before every layer and every pair of photos.
        """
        run = Run(self.begins or evenly(self.stages), progress, cancelled, kept=kept)
        with nullcontext() if cancelled is None else self.stopping(run.check):
            return self._predict(views, run, atoms, groups, redrawn, elements)

    def _predict(
        self,
        views: Views,
        run: Run,
        atoms: Atoms | None,
        groups: Lifted | None,
        redrawn: Redrawn | None,
        elements: bool,
    ) -> Prediction:
        """The stages, timed by `run`."""
        device = next(self.parameters()).device
        images, Ks = views.images[None].to(device), views.Ks[None].to(device)
        size = (images.shape[-2], images.shape[-1])
        with run.stage("encoder"):
            tokens = self.encode(images, Ks)
        language = _beside(lambda: self.language(tokens, images), device)
        geometry = self.reconstruct(views, images, Ks, tokens, run, elements)
        if geometry.bent:
            return Prediction.of_bent(geometry.bent, self.preset.space, dict(run.timings))
        views = _through(views, geometry.Ks)
        with run.stage("language features"):
            features = language()
        with run.stage("grouping"):
            weights = groups(geometry, views) if groups else self.parts(tokens, images, size, features)
            if redrawn is not None:
                weights = redrawn(weights, views)
        with run.stage("aggregation"):
            if atoms is None:
                placed = geometry.depths, geometry.viewmats, views.Ks.to(device)
                seen = Seen(images[0], tokens, *placed, views.sources)
                dictionary = self.dictionary(weights, features, seen)
            else:
                dictionary = atoms(weights, features)
        left_out = [_left_out(views.names[view]) for view in geometry.unplaced]
        return Prediction(
            gaussians=geometry.gaussians,
            weights=weights,
            dictionary=dictionary,
            space=self.preset.space,
            viewmats=geometry.viewmats,
            depths=geometry.depths,
            confidences=geometry.confidences,
            unplaced=geometry.unplaced,
            warnings=(*geometry.warnings, *left_out, *self.notes, *_of_another_size(self.trained_side, size)),
            timings=dict(run.timings),
            Ks=geometry.Ks,
            lenses=geometry.lenses,
        )


def _through(views: Views, Ks: Tensor | None) -> Views:
    """The views with the intrinsics that were found, None: with their own."""
    return views if Ks is None else replace(views, Ks=Ks.to(views.Ks))


def _beside(work: Callable[[], Tensor], device: torch.device) -> Callable[[], Tensor]:
    """Starts work on a second CUDA stream, beside what follows; elsewhere it waits until it is asked for.

    What the work reads must stay referenced until it is asked for.
    """
    if device.type != "cuda":
        return work
    here, side = torch.cuda.current_stream(device), torch.cuda.Stream(device)
    side.wait_stream(here)
    with torch.cuda.stream(side):
        answer = work()

    def joined() -> Tensor:
        here.wait_stream(side)
        answer.record_stream(here)
        return answer

    return joined


def pooled_weights(
    weights: Float[Tensor, "V K H W"], features: Float[Tensor, "B V C h w"]
) -> Float[Tensor, "n V K h w"]:
    """Weights (V, K, H, W) at the size of features (1, V, C, h, w), as a batch of one scene.

    The means of `adaptive_avg_pool2d`, the twin, which goes through them number by number: a window's mean is
    one over rows of one over columns, and both are matrix products.
    """
    rows, columns = (
        _windows(weights.shape[-dim], features.shape[-dim]).to(weights.device, _exact(weights))
        for dim in (2, 1)
    )  # (h, H), (w, W)
    return in_groups(lambda some: rows @ some.to(rows) @ columns.T, weights)[None]


def _exact(weights: Tensor) -> torch.dtype:
    """Single precision of half, which many photos' weights are held in."""
    return torch.float32 if weights.dtype == torch.float16 else weights.dtype


def _windows(length: int, count: int) -> Tensor:
    """(count, length) float64: means over so many equal parts, widened to whole numbers."""
    ends = torch.arange(count + 1) * length
    first, last = ends[:-1] // count, -(-ends[1:] // count)
    places = torch.arange(length)
    inside = (places >= first[:, None]) & (places < last[:, None])
    return inside.double() / (last - first)[:, None]


def _of_another_size(trained: int, size: tuple[int, int]) -> tuple[str, ...]:
    """A word where photos (H, W) are a quarter or more off the side that the geometry was trained on."""
    side = (size[0] * size[1]) ** 0.5
    if not trained or abs(math.log(side / trained)) < math.log(1.25):
        return ()
    return (
        f"the geometry's weights were trained on photos of {trained} x {trained} pixels and saw "
        f"{size[1]} x {size[0]} here, where they are less exact; choose --size {trained}",
    )


def _left_out(name: str) -> str:
    return (
        f"{name}: too little of it could be matched with the other photos, so it is left out; "
        "take photos that share at least a third of the picture"
    )
