"""A network whatever its geometry: photos in, `Prediction` out. Stages run once, in order, timed."""

import time
from abc import abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.errors import Cancelled, WeightsError
from langflash_core.network.aggregation import Aggregation, averaged_atoms
from langflash_core.network.encoder import Tokens
from langflash_core.network.grouping import Groups
from langflash_core.network.presets import Preset
from langflash_core.types import Gaussians, Prediction, Views

Progress = Callable[[str, float], None]
Atoms = Callable[[Tensor, Tensor], Tensor]
MEANING_STAGES = ("language features", "grouping", "aggregation")


@dataclass(frozen=True)
class Geometry:
    """What the geometry stages hand over; fields as in `Prediction`."""

    gaussians: Gaussians
    viewmats: Tensor
    depths: Tensor
    confidences: Tensor
    unplaced: tuple[int, ...]


class LangFlashNet(nn.Module):
    """What both kinds of geometry share: the order of stages, grouping, and the dictionary.

    A subclass builds its own parts and gives `encode`, `reconstruct`, `language`,
    `semantic_maps` and `parts`; every stage of training reads the network through these.
    """

    stages: tuple[str, ...]
    """Names of the timed steps, in order."""
    frozen: tuple[str, ...]
    """Parts that this project takes as they are and never trains."""
    compact: bool
    """Weights are stored as int8 rows; else as they are."""
    mixes: bool = False
    """`use_bfloat16` does something."""
    caches_tokens: bool
    """Training may read tokens from disk, because nothing that is trained changes them."""
    grouping: nn.Module
    aggregation: Aggregation

    def __init__(self, preset: Preset):
        super().__init__()
        self.preset = preset
        self.calibration: dict = {}

    def use_bfloat16(self) -> "LangFlashNet":
        """Matrix products in bfloat16 where the network has a rule for it; else nothing changes."""
        return self

    def complete(self, filled: set[str], remedy: str) -> None:
        """Settle what has no weights after those of `filled` were read.

        Raises:
            WeightsError: a module cannot do without; ends with `remedy`.
        """
        missing = [name for name, _ in self.named_children() if name not in filled]
        if missing:
            raise WeightsError(f"There are no weights for {', '.join(missing)}; {remedy}")

    @abstractmethod
    def encode(self, images: Tensor, Ks: Tensor) -> Tokens:
        """Shared tokens of images (B, V, 3, H, W) in [0, 1]; Ks (B, V, 3, 3) in their pixels."""

    @abstractmethod
    def reconstruct(self, views: Views, images: Tensor, Ks: Tensor, tokens: Tokens, run: "Run") -> Geometry:
        """The geometry stages of one scene (B = 1)."""

    @abstractmethod
    def language(self, tokens: Tokens, images: Tensor) -> Tensor:
        """L(x), (B, V, C, h, w), unit channel norm."""

    @abstractmethod
    def semantic_maps(self, tokens: Tokens, images: Tensor) -> tuple[tuple[Tensor, ...], Tensor]:
        """What queries read, coarse to fine (B*V, f, h, w) each, and the map that masks are read from."""

    @abstractmethod
    def parts(
        self, tokens: Tokens, images: Tensor, size: tuple[int, int], features: Tensor | None = None
    ) -> Tensor:
        """w_k(x) of one scene (B = 1), (V, K, *size), sums to 1 over K; features: of `language`."""

    def group(self, tokens: Tokens, images: Tensor) -> tuple[Groups, ...]:
        """Groups after each scale or layer; the last is the answer."""
        memories, finest = self.semantic_maps(tokens, images)
        return self.grouping(memories, finest, tokens.shape[1])

    aggregated = True
    """The aggregation has weights; else atoms are plain averages."""

    def dictionary(self, weights: Tensor, features: Tensor) -> Tensor:
        """Atoms (K, C) of unit norm of one scene: weights (V, K, H, W), features (1, V, C, h, w)."""
        small = pooled_weights(weights, features)
        if self.aggregated:
            return self.aggregation(small, features)[0]
        return averaged_atoms(small, features, self.preset.eps)[0]

    @torch.inference_mode()
    def predict(
        self,
        views: Views,
        progress: Progress | None = None,
        cancelled: Callable[[], bool] | None = None,
        atoms: Atoms | None = None,
    ) -> Prediction:
        """One scene from V photos of one size (sides multiples of the patch).

        Args:
            atoms: weights (V, K, H, W) and features (1, V, C, h, w) to atoms (K, C) of unit norm;
                None: `dictionary`.

        Raises:
            Cancelled: `cancelled()` became true between two stages.
        """
        run = Run(self.stages, progress, cancelled)
        device = next(self.parameters()).device
        images, Ks = views.images[None].to(device), views.Ks[None].to(device)
        with run.stage("encoder"):
            tokens = self.encode(images, Ks)
        geometry = self.reconstruct(views, images, Ks, tokens, run)
        with run.stage("language features"):
            features = self.language(tokens, images)
        with run.stage("grouping"):
            weights = self.parts(tokens, images, (images.shape[-2], images.shape[-1]), features)
        with run.stage("aggregation"):
            dictionary = (atoms or self.dictionary)(weights, features)
        return Prediction(
            gaussians=geometry.gaussians,
            weights=weights,
            dictionary=dictionary,
            space=self.preset.space,
            viewmats=geometry.viewmats,
            depths=geometry.depths,
            confidences=geometry.confidences,
            unplaced=geometry.unplaced,
            warnings=tuple(_left_out(views.names[v]) for v in geometry.unplaced),
            timings=run.timings,
        )


def pooled_weights(weights: Tensor, features: Tensor) -> Tensor:
    """Weights (V, K, H, W) at the size of features (1, V, C, h, w), as a batch of one scene."""
    if weights.shape[1] == 0:
        return weights.new_zeros(1, len(weights), 0, features.shape[-2], features.shape[-1])
    return F.adaptive_avg_pool2d(weights, (features.shape[-2], features.shape[-1]))[None]


def _left_out(name: str) -> str:
    return (
        f"{name}: too little of it could be matched with the other photos, so it is left out; "
        "take photos that share at least a third of the picture"
    )


@dataclass
class Run:
    """Times stages, reports them, and stops between them."""

    stages: tuple[str, ...]
    progress: Progress | None = None
    cancelled: Callable[[], bool] | None = None
    timings: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Around one stage.

        Raises:
            Cancelled: `cancelled()` is true.
        """
        if self.cancelled is not None and self.cancelled():
            raise Cancelled("The reconstruction was cancelled")
        if self.progress is not None:
            self.progress(name, len(self.timings) / len(self.stages))
        start = time.perf_counter()
        yield
        self.timings[name] = time.perf_counter() - start
