"""The whole network: photos in, `Prediction` out. Stages run once, in order, and are timed."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import cv2
import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.errors import Cancelled
from langflash_core.geometry.cameras import rays
from langflash_core.network.aggregation import Aggregation
from langflash_core.network.alignment import Correction
from langflash_core.network.decoder import SiameseDecoder, TwoStackDecoder
from langflash_core.network.depth import DepthHead, DepthMaps
from langflash_core.network.encoder import Encoder, Tokens, tokens_to_maps
from langflash_core.network.gaussians import GaussianHead, assemble_gaussians
from langflash_core.network.grouping import (
    Groups,
    ScratchHead,
    SemanticGrouping,
    group_weights,
    surviving,
)
from langflash_core.network.language import LanguageHead
from langflash_core.network.local import LocalFeatures
from langflash_core.network.poses import PoseInput, Poses, estimate_poses
from langflash_core.network.presets import Preset
from langflash_core.network.refiner import DepthRefiner
from langflash_core.network.splitting import split_groups
from langflash_core.types import Prediction, Views

Progress = Callable[[str, float], None]
STAGES = (
    "encoder", "depth", "poses", "refinement", "Gaussians", "language features", "grouping", "aggregation",
)  # fmt: skip


class LangFlashNet(nn.Module):
    """Learned parts of every stage; `predict` composes them with the exact ones.

    Trained stage by stage: `depth` = decoder + depth_head, `refine` = refiner, `gaussians` =
    gaussian_head, `language` = language_head, `grouping` = siamese + scratch + grouping,
    `aggregation` = aggregation. The encoder and the local features stay frozen.
    """

    def __init__(self, preset: Preset):
        super().__init__()
        self.preset = preset
        self.calibration: dict = {}
        self.encoder = Encoder(preset)
        self.local = LocalFeatures()
        self.decoder = TwoStackDecoder(preset)
        self.depth_head = DepthHead(preset)
        self.refiner = DepthRefiner(preset)
        self.gaussian_head = GaussianHead(preset)
        self.language_head = LanguageHead(preset)
        self.siamese = SiameseDecoder(preset)
        self.scratch = ScratchHead(preset)
        self.grouping = SemanticGrouping(preset)
        self.aggregation = Aggregation(preset)

    def levels(self, tokens: Tokens, Ks: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Level maps (B*V, C_i, h, w) of the geometry heads: two encoder hooks, two decoder depths."""
        decoded = self.decoder(tokens, Ks)
        deep = tuple(tokens_to_maps(t.flatten(0, 1), tokens.grid) for t in decoded)
        return tokens.maps(0), tokens.maps(1), deep[0], deep[1]

    def monocular_depth(self, tokens: Tokens, Ks: Tensor) -> DepthMaps:
        """Prior depth in metres, (B, V, H, W)."""
        return self.depth_head(self.levels(tokens, Ks), tokens)

    def group(self, tokens: Tokens, images: Tensor) -> tuple[Groups, ...]:
        """Groups after each scale; the last is the answer."""
        memories, finest = self.scratch(tokens, self.siamese(tokens), images)
        return self.grouping(memories, finest, tokens.shape[1])

    def parts(self, tokens: Tokens, images: Tensor, size: tuple[int, int]) -> Tensor:
        """w_k(x) of one scene (B = 1), (V, K, *size): the surviving groups, cut into parts."""
        memories, finest = self.scratch(tokens, self.siamese(tokens), images)
        groups = self.grouping(memories, finest, tokens.shape[1])[-1]
        survivors = surviving(groups, self.preset.tau_exist)
        whole = group_weights(groups, survivors, (finest.shape[-2], finest.shape[-1]))
        return split_groups(whole, finest, self.preset.splitting, size)

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
        self, views: Views, progress: Progress | None = None, cancelled: Callable[[], bool] | None = None
    ) -> Prediction:
        """One scene from V photos of one size (sides multiples of the patch).

        Raises:
            Cancelled: `cancelled()` became true; asked before every layer and every pair of photos.
        """
        run = _Run(progress, cancelled)
        with self.stopping(run.check):
            return self._predict(views, run)

    def _predict(self, views: Views, run: "_Run") -> Prediction:
        """The stages, timed by `run`."""
        device = next(self.parameters()).device
        images, Ks = views.images[None].to(device), views.Ks[None].to(device)
        with run.stage("encoder"):
            tokens = self.encoder(images)
        with run.stage("depth"):
            levels = self.levels(tokens, Ks)
            prior = self.depth_head(levels, tokens)
        with run.stage("poses"):
            local = self.local(images[0])
            poses = estimate_poses(self._pose_inputs(views, prior, local), run.check)
            viewmats = torch.from_numpy(poses.viewmats).to(images)[None]
        with run.stage("refinement"):
            maps = self._refine(images, tokens, local, prior, poses, viewmats, Ks)
        with run.stage("Gaussians"):
            raw = self.gaussian_head(levels, images)
            gaussians = assemble_gaussians(raw[0], images[0], maps, viewmats[0], Ks[0])
        with run.stage("language features"):
            features = self.language_head(tokens)
        with run.stage("grouping"):
            weights = self.parts(tokens, images, (images.shape[-2], images.shape[-1]))
        with run.stage("aggregation"):
            pooled = F.adaptive_avg_pool2d(weights, (features.shape[-2], features.shape[-1]))
            dictionary = self.aggregation(pooled[None], features)[0]
        return Prediction(
            gaussians=gaussians,
            weights=weights,
            dictionary=dictionary,
            space=self.preset.space,
            viewmats=viewmats[0],
            depths=maps.depths,
            confidences=maps.confidences,
            unplaced=poses.guessed,
            warnings=tuple(_guess_warning(views.names[v]) for v in poses.guessed),
            timings=run.timings,
        )

    def _refine(self, images, tokens, local, prior: DepthMaps, poses: Poses, viewmats, Ks) -> DepthMaps:
        """Refined maps (V, H, W), in view 0's unit; a view of unknown pose keeps its prior."""
        logs = [
            _corrected(prior.log_depths[0, v], K, correction) + math.log(scale)
            for v, (K, scale, correction) in enumerate(
                zip(Ks[0], poses.depth_scales, poses.corrections, strict=True)
            )
        ]
        scaled = DepthMaps(torch.stack(logs)[None], prior.log_errors)
        keep = [v for v in range(images.shape[1]) if v not in poses.guessed]
        maps = DepthMaps(scaled.log_depths[0], scaled.log_errors[0])
        if len(keep) < 2:
            return maps
        chosen = Tokens(tuple(h[:, keep] for h in tokens.hooks), tokens.grid)
        part = DepthMaps(scaled.log_depths[:, keep], scaled.log_errors[:, keep])
        refined = self.refiner(images[:, keep], chosen, local[keep], part, viewmats[:, keep], Ks[:, keep])
        log_depths, log_errors = maps.log_depths.clone(), maps.log_errors.clone()
        log_depths[keep], log_errors[keep] = refined.log_depths[0], refined.log_errors[0]
        return DepthMaps(log_depths, log_errors)

    @staticmethod
    def _pose_inputs(views: Views, prior: DepthMaps, local: Tensor) -> list[PoseInput]:
        return [
            PoseInput(
                grey=_grey(views, v),
                K=views.Ks[v].double().numpy(),
                size=views.size,
                depth=prior.depths[0, v].cpu().numpy(),
                local=local[v].cpu().numpy(),
            )
            for v in range(views.num_views)
        ]


def _corrected(log_depths: Tensor, K: Tensor, correction: Correction) -> Tensor:
    """Log depths (H, W) straightened by the matches."""
    height, width = log_depths.shape
    x = rays(K, width, height)[..., :2].cpu().numpy()
    change = correction.at(x, log_depths.cpu().numpy())
    return log_depths + torch.from_numpy(change).to(log_depths)


def _grey(views: Views, view: int) -> np.ndarray:
    """The largest version of the photo at hand, as (h, w) uint8."""
    if views.sources:
        grey = cv2.imdecode(np.frombuffer(views.sources[view], np.uint8), cv2.IMREAD_GRAYSCALE)
        assert grey is not None, "sources are JPEG bytes that images/ wrote"
        return grey
    rgb = (views.images[view].movedim(0, -1).cpu().numpy() * 255).round().astype(np.uint8)
    return cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)


def _guess_warning(name: str) -> str:
    return (
        f"{name}: too little of it could be matched with the other photos, so it is left out; "
        "take photos that share at least a third of the picture"
    )


@dataclass
class _Run:
    """Times stages, reports them, and stops between them."""

    progress: Progress | None
    cancelled: Callable[[], bool] | None
    timings: dict[str, float] = field(default_factory=dict)

    def check(self) -> None:
        """Stop here if asked to."""
        if self.cancelled is not None and self.cancelled():
            raise Cancelled("The reconstruction was cancelled")

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        self.check()
        if self.progress is not None:
            self.progress(name, len(self.timings) / len(STAGES))
        start = time.perf_counter()
        yield
        self.timings[name] = time.perf_counter() - start
