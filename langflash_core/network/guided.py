"""The network with guided depth: depth maps, matches, poses and a plane sweep give the geometry."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from types import MappingProxyType
from typing import cast

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.many import FEW, groups_of, in_half_precision, together
from langflash_core.base.memory import give_back
from langflash_core.base.running import Run
from langflash_core.cameras.poses import Poses
from langflash_core.cameras.retrieval import likeness
from langflash_core.cameras.structure import (
    find_poses,
    found_lenses,
    is_other_lens,
    placed_rig,
    rescale_poses,
)
from langflash_core.depth.surfaces import one_by_one, one_surface
from langflash_core.network.encoders.late import LateHalf, with_taught
from langflash_core.network.encoders.local import LocalFeatures
from langflash_core.network.encoders.others import OtherEyes
from langflash_core.network.encoders.shared import Encoder, Tokens, tokens_to_maps
from langflash_core.network.gaussians import GaussianHead, assemble_gaussians
from langflash_core.network.layers.decoder import SiameseDecoder, TwoStackDecoder
from langflash_core.network.model import MEANING_STAGES, Geometry, LangFlashNet, Seen
from langflash_core.network.presets import GuidedDepth
from langflash_core.network.prior import DepthHead
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
from langflash_core.network.semantics.splitting import condense_features, joint_maps, split_groups, split_maps
from langflash_core.network.sweep import DepthRefiner
from langflash_core.rig.neighbours import source_views
from langflash_core.rig.pairs import best
from langflash_core.rig.rig import DepthMaps, Rig
from langflash_core.rig.settings import CHOICE
from langflash_core.types import Gaussians, Views

_CLOSELY = 32  # photos, up to which language features are held at their full size


class GuidedDepthNet(LangFlashNet):
    """Learned parts of every stage; `reconstruct` composes them with the exact ones.

    Trained stage by stage: `depth` = decoder + depth_head, `refine` = refiner, `gaussians` =
    gaussian_head, `language` = language_head, `grouping` = siamese + scratch + grouping,
    `aggregation` = aggregation, `naming` = namer; `late` and `deep`, the halves that real photos taught names
    and depth, learn before (`train late`); `second_head` reads the other networks' maps (`train second`). The
    encoder, the local features and the other networks stay frozen.
    """

    frozen = ("encoder", "local", "others")
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
        self.others = OtherEyes()
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
        return Tokens.beside([self._encode_images(images[:, some]) for some in groups_of(images.shape[1])])

    def _encode_images(self, images: Tensor) -> Tokens:
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
        return [sorted(row) for row in best(likeness(list(rows)), CHOICE.read)]

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
            return in_half_precision(own, count)

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
        meant = condense_features(features)

        def joint(number: int) -> Tensor:
            fine = finest[number].float()
            groups = grouping.masks(queries, fine)
            whole = group_weights(groups, survivors, (fine.shape[-2], fine.shape[-1]))
            return joint_maps(whole, fine, meant[some[number]], rule)

        return split_maps([partial(joint, number) for number in range(len(some))], len(features), rule, size)

    def named(
        self, atoms: Float[Tensor, "K C"], weights: Float[Tensor, "V K H W"], seen: Seen
    ) -> Float[Tensor, "K C"]:
        """Atoms corrected by deep tokens, places and each other, and by what other networks say."""
        if len(atoms) == 0:
            return atoms
        where = places(weights, seen.depths, seen.viewmats, seen.Ks)
        named = self.namer(atoms, describe(weights, seen.tokens), where)
        if self.second_head.silent:
            return named
        return both(named, looked_at(self.others, self.second_head, seen.pictures(), weights))

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
            levels, prior = self._predict_depth(tokens, Ks)
        with run.stage("poses"):
            local = one_by_one(self.local, images[0])
            poses = find_poses(views, Ks[0], prior, local, run)
            if poses.bent:
                return Geometry.of_bent(poses.bent)
            Ks = found_lenses(Ks[0], poses)[None]
            if is_other_lens(poses):
                levels, prior = self._predict_depth(tokens, Ks)
                poses = rescale_poses(poses, views, Ks[0], prior, local)
            rig = placed_rig(images[0], Ks[0], prior, poses)
        with run.stage("refinement"):
            rig = one_surface(self._refine(rig, tokens, local, poses.guessed), poses.guessed, views, run)
        gaussians = Gaussians.none()
        if elements:
            with run.stage("Gaussians"):
                raw, maps = self.gaussian_head(levels, images), DepthMaps(rig.log_depths, rig.log_errors)
                gaussians = assemble_gaussians(raw[0], images[0], maps, rig.viewmats, rig.Ks)
        return _geometry(gaussians, rig, poses, views)

    def _predict_depth(self, tokens: Tokens, Ks: Tensor) -> tuple[tuple[Tensor, ...], DepthMaps]:
        """What the geometry heads read, and depth of each photo by itself."""
        levels = self.levels(tokens, Ks)
        return levels, self._prior(levels, tokens)

    def _refine(self, rig: Rig, tokens: Tokens, local: Tensor, guessed: Sequence[int]) -> Rig:
        """Depths refined by the sweep; a view of unknown pose keeps its prior."""
        keep = [v for v in range(len(rig)) if v not in guessed]
        if len(keep) < 2:
            return rig
        assert rig.photos is not None, "photos are what is compared"
        near = source_views(rig.some(keep))
        log_depths, log_errors = rig.log_depths.clone(), rig.log_errors.clone()
        for some in groups_of(len(keep)):
            own, others = keep[some], [[keep[other] for other in of] for of in near[some]]
            ids = own if len(own) == len(keep) else [*own, *sorted({o for of in others for o in of} - {*own})]
            refined = self.refiner(
                rig.photos[None, ids],
                tokens.views(ids),
                local[ids],
                DepthMaps(rig.log_depths[None, own], rig.log_errors[None, own]),
                rig.viewmats[None, ids],
                rig.Ks[None, ids],
                [[ids.index(other) for other in of] for of in others],
                len(own),
            )[-1]
            log_depths[own], log_errors[own] = refined.log_depths[0], refined.log_errors[0]
            if len(ids) > len(own):
                give_back()  # groups look at more and fewer others: what one leaves fits no other
        return Rig.of_logs(log_depths, rig.viewmats, rig.Ks, log_errors, rig.photos)


def _geometry(gaussians: Gaussians, rig: Rig, poses: Poses, views: Views) -> Geometry:
    """What is handed over, with the lenses that were found."""
    assert rig.confidences is not None, "depth comes with its errors"
    found = () if views.lenses is None else views.lenses.found(poses.lenses)
    notes = (poses.doubt,) if poses.doubt else ()
    maps = rig.viewmats, rig.depths, rig.confidences
    return Geometry(gaussians, *maps, poses.guessed, rig.Ks.cpu(), found, notes)
