"""The network with guided depth: depth maps, matches, poses and a plane sweep give the geometry."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import cast

import cv2
import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import rays
from langflash_core.keeping import MATCHES
from langflash_core.memory import give_back
from langflash_core.network.encoders.deeplab import DeepLab
from langflash_core.network.encoders.late import LateHalf, with_taught
from langflash_core.network.encoders.local import LocalFeatures
from langflash_core.network.encoders.shared import Encoder, Tokens, tokens_to_maps
from langflash_core.network.gaussians import GaussianHead, assemble_gaussians
from langflash_core.network.layers.decoder import SiameseDecoder, TwoStackDecoder
from langflash_core.network.many import FEW, groups_of, held, in_groups, together
from langflash_core.network.model import MEANING_STAGES, Geometry, LangFlashNet, Seen
from langflash_core.network.presets import GuidedDepth
from langflash_core.network.semantics.aggregation import Aggregation
from langflash_core.network.semantics.features import LanguageHead
from langflash_core.network.semantics.grouping import (
    ScratchHead,
    SemanticGrouping,
    group_weights,
    surviving,
    surviving_of,
)
from langflash_core.network.semantics.naming import PartNamer, describe, places
from langflash_core.network.semantics.second import SecondHead, both, looked_at
from langflash_core.network.semantics.splitting import condensed, joint_maps, split_groups, split_maps
from langflash_core.network.stereo.adjustment import Sought
from langflash_core.network.stereo.agreement import agreed
from langflash_core.network.stereo.alignment import Correction
from langflash_core.network.stereo.inputs import grown
from langflash_core.network.stereo.keypoints import KeyPoints, decoded, match_photos, match_sources
from langflash_core.network.stereo.planes import flattened
from langflash_core.network.stereo.planesweep import searched
from langflash_core.network.stereo.poses import PoseInput, Poses, estimate_poses, on_other_maps
from langflash_core.network.stereo.prior import DepthHead, DepthMaps
from langflash_core.network.stereo.registration import registered
from langflash_core.network.stereo.retrieval import most_alike
from langflash_core.network.stereo.sharpening import sharpened
from langflash_core.network.stereo.sweep import DepthRefiner
from langflash_core.rig.neighbours import source_views
from langflash_core.rig.rig import Rig
from langflash_core.running import Run
from langflash_core.types import Gaussians, Views

_SWEPT = 0.3  # of the time of refinement, before photos are registered one by one
_READ = 15  # photos that each of many reads in the decoder
_CLOSELY = 32  # photos, up to which language features are held at their full size
_OTHER_LENS = 0.01
"""Change of the focal length, as a logarithm, from which depth is predicted anew: it is known no better."""


class GuidedDepthNet(LangFlashNet):
    """Learned parts of every stage; `reconstruct` composes them with the exact ones.

    Trained stage by stage: `depth` = decoder + depth_head, `refine` = refiner, `gaussians` =
    gaussian_head, `language` = language_head, `grouping` = siamese + scratch + grouping,
    `aggregation` = aggregation, `naming` = namer; `late` and `deep`, the halves that real photos taught names
    and depth, learn before (`train late`); `second_head` reads DeepLab's maps (`train second`). The encoder,
    the local features and DeepLab stay frozen.
    """

    frozen = ("encoder", "local", "deeplab")
    compact = True
    bfloat16_on_cpu = False  # a seventh of a second quicker, and a part in forty merges otherwise
    surfaces = True
    caches_tokens = True
    stages = ("encoder", "depth", "poses", "refinement", "Gaussians", *MEANING_STAGES)
    begins = MappingProxyType(dict(zip(stages, (0.0, 0.07, 0.1, 0.2, 0.8, 0.82, 0.85, 0.97), strict=True)))

    def __init__(self, preset: GuidedDepth):
        super().__init__(preset)
        self.mixed = False
        self.encoder = Encoder(preset)
        self.late = LateHalf(preset)
        self.deep = LateHalf(preset, given=1)
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
        self.namer = PartNamer(preset)
        self.deeplab = DeepLab()
        self.second_head = SecondHead(preset)

    def begin_halves(self) -> None:
        """Let the late halves give the encoder's own tokens, until something is learned."""
        for half in (self.late, self.deep):
            half.begin(self.encoder.vit)

    def use_bfloat16(self) -> "GuidedDepthNet":
        """Transformers and what names things in it. Depth heads, sweep, local features, poses and Gaussians
        stay exact: in bfloat16 they would triple the change of the depths for a quarter of a second."""
        self.mixed = True
        return self

    @contextmanager
    def _fast(self, images: Tensor) -> Iterator[None]:
        with torch.autocast(images.device.type, torch.bfloat16) if self.mixed else nullcontext():
            yield

    def encode(self, images: Float[Tensor, "B V 3 H W"], Ks: Float[Tensor, "B V 3 3"]) -> Tokens:
        """Four hooks of the frozen encoder, two of the half that names of real photos taught and one of that
        which their depth taught; the intrinsics join later."""
        return Tokens.beside([self._encoded(images[:, some]) for some in groups_of(images.shape[1])])

    def _encoded(self, images: Tensor) -> Tokens:
        with self._fast(images):
            tokens, early = self.encoder(images)
            tokens = with_taught(tokens, early, self.encoder.vit, self.late, self.deep)
        return tokens.each(self._exact)

    def levels(
        self, tokens: Tokens, Ks: Float[Tensor, "B V 3 3"]
    ) -> tuple[
        Float[Tensor, "n _ _ _"], Float[Tensor, "n _ _ _"], Float[Tensor, "n _ _ _"], Float[Tensor, "n _ _ _"]
    ]:
        """Level maps (B*V, C_i, h, w) of the geometry heads: two encoder hooks, two decoder depths.

        Of many photos each reads those most like it.
        """
        read = self._alike(tokens) if tokens.shape[1] > FEW else None
        with self._fast(Ks):
            decoded = self.decoder(tokens, Ks, read)
        deep = tuple(tokens_to_maps(self._exact(t).flatten(0, 1), tokens.grid) for t in decoded)
        return tokens.maps(0), tokens.maps(1), deep[0], deep[1]

    def _alike(self, tokens: Tokens) -> list[list[int]]:
        """Of each view of one scene (B = 1) those most like it."""
        rows = F.normalize(tokens.hooks[self.refiner.match_hook][0].float(), dim=-1).cpu().numpy()
        return most_alike(list(rows), _READ)

    def _prior(self, levels: tuple[Tensor, ...], tokens: Tokens) -> DepthMaps:
        """Depth of one scene (B = 1), some views at a time."""
        count = tokens.shape[1]
        parts = [
            self.depth_head(
                tuple(level[some] for level in levels), tokens.views(range(some.start, some.stop))
            )
            for some in groups_of(count)
        ]
        logs, errors = (part.log_depths for part in parts), (part.log_errors for part in parts)
        return DepthMaps(together(logs, count, 1), together(errors, count, 1))

    def monocular_depth(self, tokens: Tokens, Ks: Float[Tensor, "B V 3 3"]) -> DepthMaps:
        """Prior depth in metres, (B, V, H, W)."""
        return self.depth_head(self.levels(tokens, Ks), tokens)

    def language(self, tokens: Tokens, images: Float[Tensor, "B V 3 H W"]) -> Float[Tensor, "B V C h w"]:
        """L(x) from the shared tokens, at four times their grid; of very many photos at twice."""
        count = tokens.shape[1]

        def features(some: slice) -> Tensor:
            with self._fast(images):
                own = self._exact(self.language_head(tokens.views(range(some.start, some.stop))))
            if count > _CLOSELY:
                own = F.normalize(F.avg_pool2d(own.flatten(0, 1), 2), dim=1).unflatten(0, own.shape[:2])
            return held(own, count)

        return together(map(features, groups_of(count)), count, 1)

    def semantic_maps(
        self, tokens: Tokens, images: Float[Tensor, "B V 3 H W"]
    ) -> tuple[tuple[Float[Tensor, "n C _ _"], ...], Float[Tensor, "n C h w"]]:
        """Memories at 1, 2 and 4 times the grid, and the mask map at 8 times."""
        with self._fast(images):
            memories, finest = self.scratch(tokens, self.siamese(tokens), images)
        return tuple(map(self._exact, memories)), self._exact(finest)

    def _exact(self, values: Tensor) -> Tensor:
        """Out of bfloat16 again. Training under autocast of its own goes on as it was."""
        return values.float() if self.mixed else values

    def parts(
        self,
        tokens: Tokens,
        images: Float[Tensor, "B V 3 H W"],
        size: tuple[int, int],
        features: Float[Tensor, "B V C h w"] | None = None,
    ) -> Float[Tensor, "V J mh mw"]:
        """The surviving groups, cut into parts, also by what their pixels are called."""
        if features is None:
            features = self.language(tokens, images)
        if tokens.shape[1] > FEW:
            return self._parts_of_many(tokens, images, size, features[0])
        whole, finest = self.wholes(tokens, images)
        return split_groups(whole, finest, self.preset.splitting, size, features[0].float())

    def wholes(
        self, tokens: Tokens, images: Float[Tensor, "B V 3 H W"]
    ) -> tuple[Float[Tensor, "V K h w"], Float[Tensor, "V f h w"]]:
        """The surviving groups of one scene (B = 1), uncut, and the map that they are read from."""
        memories, finest = self.semantic_maps(tokens, images)
        groups = self.grouping(memories, finest, tokens.shape[1])[-1]
        survivors = surviving(groups, self.preset.tau_exist)
        return group_weights(groups, survivors, (finest.shape[-2], finest.shape[-1])), finest

    def _parts_of_many(
        self, tokens: Tokens, images: Tensor, size: tuple[int, int], features: Tensor
    ) -> Tensor:
        """`parts`, some views at a time; features (V, C, h, w)."""
        rule, some = self.preset.splitting, groups_of(tokens.shape[1])
        grouping = cast(SemanticGrouping, self.grouping)
        memories, finest = [], []
        for own in some:
            read, fine = self.semantic_maps(tokens.views(range(own.start, own.stop)), images[:, own])
            memories.append(read)
            finest.append(fine.half())
            del fine
            give_back()
        queries = grouping.of_many(memories)
        del memories
        strongest, existence = [], None
        for fine in finest:
            masks = grouping.masks(queries, fine.float())
            strongest.append(masks.mask_logits[0].amax((0, 2, 3)))
            existence = masks.existence_logits[0]
        assert existence is not None, "there are many views"
        survivors = surviving_of(strongest, existence, self.preset.tau_exist)
        if len(survivors) == 0:
            return images.new_zeros(images.shape[1], 0, *size)
        meant = condensed(features)

        def joint(number: int) -> Tensor:
            fine = finest[number].float()
            groups = grouping.masks(queries, fine)
            whole = group_weights(groups, survivors, (fine.shape[-2], fine.shape[-1]))
            return joint_maps(whole, fine, meant[some[number]], rule)

        return split_maps([partial(joint, number) for number in range(len(some))], len(features), rule, size)

    def named(
        self, atoms: Float[Tensor, "K C"], weights: Float[Tensor, "V K H W"], seen: Seen
    ) -> Float[Tensor, "K C"]:
        """Atoms corrected by deep tokens, places and each other, and by what a second network says."""
        if len(atoms) == 0:
            return atoms
        where = places(weights, seen.depths, seen.viewmats, seen.Ks)
        named = self.namer(atoms, describe(weights, seen.tokens), where)
        if self.second_head.silent:
            return named
        return both(named, looked_at(self.deeplab, self.second_head, seen.images, weights))

    def reconstruct(
        self,
        views: Views,
        images: Float[Tensor, "B V 3 H W"],
        Ks: Float[Tensor, "B V 3 3"],
        tokens: Tokens,
        run: Run,
        elements: bool = True,
    ) -> Geometry:
        """Depth, poses, refined depth with edges and flat surfaces that agrees between photos, Gaussians."""
        with run.stage("depth"):
            levels = self.levels(tokens, Ks)
            prior = self._prior(levels, tokens)
        with run.stage("poses"):
            local = _one_by_one(self.local, images[0])
            inputs = self._pose_inputs(Ks[0], views.size, prior, local)
            poses = estimate_poses(inputs, _key_points(views, run), run.check, _known(views), _sought(views))
            if poses.bent:
                return Geometry.of_bent(poses.bent)
            Ks = _with_lens(Ks, poses)
            if np.abs(np.log(poses.growths)).max() > _OTHER_LENS:
                levels = self.levels(tokens, Ks)
                prior = self._prior(levels, tokens)
                poses = on_other_maps(poses, self._pose_inputs(Ks[0], views.size, prior, local))
            viewmats = torch.from_numpy(poses.viewmats).to(images)[None]
        with run.stage("refinement"):
            maps = self._refine(images, tokens, local, prior, poses, viewmats, Ks)
            sharp = _one_by_one(sharpened, maps.log_depths, images[0])
            maps = replace(maps, log_depths=in_groups(flattened, sharp, maps.log_errors))
            maps = _agreed(maps, images[0], views, poses, viewmats[0], Ks[0], run)
        if not elements:
            return _geometry(Gaussians.none(), maps, poses, viewmats[0], Ks[0], views)
        with run.stage("Gaussians"):
            raw = self.gaussian_head(levels, images)
            gaussians = assemble_gaussians(raw[0], images[0], maps, viewmats[0], Ks[0])
        return _geometry(gaussians, maps, poses, viewmats[0], Ks[0], views)

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
        near = source_views(Rig.of_logs(maps.log_depths[keep], viewmats[0, keep], Ks[0, keep]))
        log_depths, log_errors = maps.log_depths.clone(), maps.log_errors.clone()
        for some in groups_of(len(keep)):
            own, others = keep[some], [[keep[other] for other in of] for of in near[some]]
            ids = own if len(own) == len(keep) else [*own, *sorted({o for of in others for o in of} - {*own})]
            refined = self.refiner(
                images[:, ids],
                tokens.views(ids),
                local[ids],
                DepthMaps(scaled.log_depths[:, own], scaled.log_errors[:, own]),
                viewmats[:, ids],
                Ks[:, ids],
                [[ids.index(other) for other in of] for of in others],
                len(own),
            )[-1]
            log_depths[own], log_errors[own] = refined.log_depths[0], refined.log_errors[0]
            if len(ids) > len(own):
                give_back()  # groups look at more and fewer others: what one leaves fits no other
        return DepthMaps(log_depths, log_errors)

    @staticmethod
    def _pose_inputs(Ks: Tensor, size: tuple[int, int], prior: DepthMaps, local: Tensor) -> list[PoseInput]:
        depths = prior.depths[0].cpu().numpy()  # once: a view of every call's own would hold all of it
        return [
            PoseInput(
                K=K.double().cpu().numpy(),
                size=size,
                depth=depths[v],
                local=local[v].cpu().numpy(),
            )
            for v, K in enumerate(Ks)
        ]


def _one_by_one(work: Callable[..., Tensor], *of_views: Tensor) -> Tensor:
    """What `work` makes of all views (V, ...), view by view: a processor's caches hold one, not eight."""
    return torch.cat([work(*own) for own in zip(*(values.split(1) for values in of_views), strict=True)])


def _agreed(
    maps: DepthMaps, images: Tensor, views: Views, poses: Poses, viewmats: Tensor, Ks: Tensor, run: Run
) -> DepthMaps:
    """Maps (V, H, W); those of known pose show one surface, to a fraction of the photos' pixels, and what the
    maps had missed."""
    placed = [v for v in range(len(viewmats)) if v not in poses.guessed]
    if len(placed) < 2:
        return maps
    part = DepthMaps(maps.log_depths[placed], maps.log_errors[placed])
    cameras = viewmats[placed], Ks[placed]
    near = source_views(Rig.of_logs(part.log_depths, *cameras))
    part = agreed(part, *cameras, near)
    photos = _greys(views)
    greys = [photos[v] for v in placed]
    logs = searched(part.log_depths, greys, *cameras, near, run.check)
    part = replace(part, log_depths=_one_by_one(sharpened, logs, images[placed]))
    told = run.counted("refinement", "photo", range(len(placed)), _SWEPT)

    def each(view: int, make: Callable[[], Tensor]) -> Tensor:
        next(told)
        found = run.kept(f"depth-{view}", lambda: {"log_depths": make().cpu().numpy()})
        return torch.from_numpy(np.array(found["log_depths"])).to(logs)

    log_depths = maps.log_depths.clone()
    part = registered(part, greys, *cameras, near, run.check, each)
    log_depths[placed] = in_groups(flattened, part.log_depths, part.log_errors)
    return replace(maps, log_depths=log_depths)


def _geometry(
    gaussians: Gaussians, maps: DepthMaps, poses: Poses, viewmats: Tensor, Ks: Tensor, views: Views
) -> Geometry:
    """What is handed over, with the lenses that were found."""
    found = () if views.lenses is None else views.lenses.found(poses.lenses)
    depths, confidences = maps.depths, maps.confidences
    notes = (poses.doubt,) if poses.doubt else ()
    return Geometry(gaussians, viewmats, depths, confidences, poses.guessed, Ks.cpu(), found, notes)


def _sought(views: Views) -> Sought | None:
    """Lenses that are not given."""
    return (
        None
        if views.lenses is None
        else Sought(views.lenses.of, views.lenses.doubts, not views.lenses.straight)
    )


def _with_lens(Ks: Tensor, poses: Poses) -> Tensor:
    """Intrinsics (1, V, 3, 3) of the lenses that were found."""
    if poses.adjusted is None or (poses.growths == 1).all():
        return Ks
    return torch.from_numpy(grown(Ks[0].double().cpu().numpy(), poses.growths)).to(Ks)[None]


def _known(views: Views) -> np.ndarray | None:
    """Poses that were given, float64, world = view 0."""
    return None if views.viewmats is None else views.viewmats.double().cpu().numpy()


def _corrected(log_depths: Tensor, K: Tensor, correction: Correction) -> Tensor:
    """Log depths (H, W) straightened by the matches."""
    height, width = log_depths.shape
    x = rays(K, width, height)[..., :2].cpu().numpy()
    change = correction.at(x, log_depths.cpu().numpy())
    return log_depths + torch.from_numpy(change).to(log_depths)


def _key_points(views: Views, run: Run) -> KeyPoints:
    """Of the largest version of the photos at hand."""
    if not views.sources:
        return match_photos(_greys(views), run.check)
    return KeyPoints.of(run.kept(MATCHES, lambda: match_sources(views.sources, run.check).arrays()))


def _greys(views: Views) -> list[np.ndarray]:
    """The largest version of the photos at hand, (h, w) uint8 each."""
    if views.sources:
        return [decoded(source) for source in views.sources]
    photos = (views.images.movedim(1, -1).cpu().numpy() * 255).round().astype(np.uint8)  # (V, H, W, 3)
    return [cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY) for rgb in photos]
