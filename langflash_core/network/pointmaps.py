"""The network of the paper: point maps of every view in the first camera's frame, all in one pass."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import torch
from jaxtyping import Float
from torch import Tensor, nn

from langflash_core.base.running import Run
from langflash_core.network.encoders.lseg import LSeg
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.encoders.vit import RotaryEncoder
from langflash_core.network.layers.decoder import TwoStacks
from langflash_core.network.model import MEANING_STAGES, Geometry, LangFlashNet
from langflash_core.network.points.heads import Levels, ParameterHead, PerView, PointHead, activate_gaussians
from langflash_core.network.points.resection import depths_and_confidences, resect
from langflash_core.network.presets import PointMaps
from langflash_core.network.semantics.aggregation import Aggregation
from langflash_core.network.semantics.grouping import group_weights, surviving
from langflash_core.network.semantics.residual import ResidualGrouping, ScratchPair, filter_queries
from langflash_core.network.semantics.splitting import split_groups
from langflash_core.types import Views


class PointMapNet(LangFlashNet):
    """ViT encoder, two decoder stacks, point and Gaussian heads, LSeg, grouping, aggregation.

    The tokens that all heads share are the encoder's output and three depths of the decoder, so
    both run once. Trained stage by stage: `points` = decoder + point_heads, `gaussians` =
    gaussian_heads, `grouping` = scratch + grouping, `aggregation` = aggregation.

    grouped: there are weights for `scratch` and `grouping`; without them groups are clusters of
    the language features. aggregated: likewise for `aggregation`; atoms are averages without.
    Where the preset says `own_grouping`, `scratch` reads `grouping_encoder` and `grouping_decoder`.
    mixed: bfloat16 where it costs little (see `use_bfloat16`).
    """

    frozen = ("encoder", "language_head")
    compact = False
    surfaces = False
    caches_tokens = False
    stages = ("encoder", "point maps", "poses", "Gaussians", *MEANING_STAGES)

    def __init__(self, preset: PointMaps):
        super().__init__(preset)
        self.sizes = preset
        self.grouped, self.aggregated, self.mixed = True, True, False
        self.encoder = RotaryEncoder(preset)
        self.decoder = TwoStacks(preset, preset.norm_eps)
        self.point_heads = PerView([PointHead(preset), PointHead(preset)])
        self.gaussian_heads = PerView([ParameterHead(preset), ParameterHead(preset)])
        self.language_head = LSeg(preset)
        self.scratch = ScratchPair(preset)
        self.grouping = ResidualGrouping(preset)
        self.aggregation = Aggregation(preset)
        if preset.own_grouping:
            self.grouping_encoder = RotaryEncoder(preset)
            self.grouping_decoder = TwoStacks(preset, preset.norm_eps)

    def use_bfloat16(self) -> "PointMapNet":
        """Matrix products in bfloat16, for transformers and Gaussian heads; points stay float32.

        A point's distance is e^|v|: an error of v there would be one of depth. Weights of the
        products are kept in bfloat16, which halves the memory as well. There is no way back.
        """
        quick = ("encoder", "decoder", "gaussian_heads", "language_head", "scratch")
        for part in (getattr(self, name) for name in (*quick, *self._copies())):
            for layer in part.modules():
                if isinstance(layer, nn.Linear | nn.Conv2d | nn.ConvTranspose2d):
                    layer.to(torch.bfloat16)
        self.mixed = True
        return self

    def complete(self, filled: set[str], remedy: str) -> None:
        """Without grouping weights groups are clusters; without aggregation's, atoms are averages.

        Raises:
            WeightsError: geometry or language features have none.
        """
        if not {"scratch", "grouping"} <= filled:
            for name in ("scratch", "grouping", *self._copies()):
                delattr(self, name)
            self.grouped = False
        if "aggregation" not in filled:
            self.aggregation = Aggregation(self.preset).eval()
            self.aggregated = False
        super().complete(filled | {"aggregation"}, remedy)

    @contextmanager
    def _fast(self, images: Tensor) -> Iterator[None]:
        with torch.autocast(images.device.type, torch.bfloat16, enabled=self.mixed):
            yield

    def encode(self, images: Float[Tensor, "B V 3 H W"], Ks: Float[Tensor, "B V 3 3"]) -> Tokens:
        """Encoder output and three decoder depths; a single photo is paired with itself."""
        grid = (images.shape[-2] // self.preset.patch, images.shape[-1] // self.preset.patch)
        hooks = self._hooks(self.encoder, self.decoder, images, Ks, grid)
        if not self._copies():
            return Tokens(hooks, grid)
        grouped = self._hooks(self.grouping_encoder, self.grouping_decoder, images, Ks, grid)
        return Tokens(hooks, grid, grouped=grouped)

    def _copies(self) -> tuple[str, ...]:
        """What is there for the grouping alone."""
        both = ("grouping_encoder", "grouping_decoder")
        return both if self.sizes.own_grouping and self.grouped else ()

    def _hooks(
        self, encoder: RotaryEncoder, decoder: TwoStacks, images: Tensor, Ks: Tensor, grid: tuple[int, int]
    ) -> tuple[Tensor, ...]:
        num_views = images.shape[1]
        with self._fast(images):
            encoded = encoder(images, Ks)
            paired = encoded if num_views > 1 else encoded.expand(-1, 2, -1, -1)
            layers = decoder.layers(decoder.embed(paired), grid)
        hooks = (encoded, *(layers[depth - 1][:, :num_views] for depth in self.sizes.decoder_hooks))
        return tuple(hook[:, :, :-1].float() for hook in hooks)

    def point_maps(self, tokens: Tokens, images: Float[Tensor, "B V 3 H W"]) -> Float[Tensor, "B V 3 H W"]:
        """Points (B, V, 3, H, W) in view 0's frame."""
        with torch.autocast(images.device.type, enabled=False):
            return self.point_heads(_levels(tokens), images)

    def raw_gaussians(self, tokens: Tokens, images: Float[Tensor, "B V 3 H W"]) -> Tensor:
        """Raw parameters (B, V, 8 + 3 S, H, W)."""
        with self._fast(images):
            return self.gaussian_heads(_levels(tokens), images, with_images=True)

    def language(self, tokens: Tokens, images: Float[Tensor, "B V 3 H W"]) -> Float[Tensor, "B V C h w"]:
        """L(x) of LSeg, at half the picture's size."""
        with self._fast(images):
            return self.language_head(images)

    def semantic_maps(
        self, tokens: Tokens, images: Float[Tensor, "B V 3 H W"]
    ) -> tuple[tuple[Float[Tensor, "n C _ _"], ...], Float[Tensor, "n C h w"]]:
        """Memories at 1, 2 and 4 times the grid, and the mask map at the picture's size."""
        with self._fast(images):
            memories, finest = self.scratch(tokens.for_grouping(), images)
        return tuple(memory.float() for memory in memories), finest.float()

    def parts(
        self,
        tokens: Tokens,
        images: Float[Tensor, "B V 3 H W"],
        size: tuple[int, int],
        features: Float[Tensor, "B V C h w"] | None = None,
    ) -> Float[Tensor, "V J mh mw"]:
        """Softmax over the masks that pass the preset's filter."""
        if not self.grouped:
            features = self.language(tokens, images) if features is None else features
            return self._clusters(features[0], size)
        groups = self.group(tokens, images)[-1]
        rule = self.sizes.mask_filter
        chosen = surviving(groups, self.preset.tau_exist) if rule is None else filter_queries(groups, rule)
        return group_weights(groups, chosen, size)

    def _clusters(self, features: Tensor, size: tuple[int, int]) -> Tensor:
        """Parts of like language features (V, C, h, w): what is left where no grouping was trained."""
        whole = features.new_ones(len(features), 1, *features.shape[-2:])
        return split_groups(whole, features, replace(self.preset.splitting, agreement=0.0), size)

    def reconstruct(
        self,
        views: Views,
        images: Float[Tensor, "B V 3 H W"],
        Ks: Float[Tensor, "B V 3 3"],
        tokens: Tokens,
        run: Run,
        elements: bool = True,
    ) -> Geometry:
        """Points, the cameras that see them, Gaussians."""
        with run.stage("point maps"):
            points = self.point_maps(tokens, images)[0]
        with run.stage("poses"):
            placed = [resect(points[v], Ks[0, v]) for v in range(1, len(points))]
            viewmats = torch.eye(4).to(points).repeat(len(points), 1, 1)
            for view, found in enumerate(placed, 1):
                viewmats[view] = torch.from_numpy(found.viewmat).to(points)
            depths, confidences = depths_and_confidences(points, viewmats, Ks[0])
        with run.stage("Gaussians"):
            gaussians = activate_gaussians(self.raw_gaussians(tokens, images)[0], points)
        unplaced = tuple(view for view, found in enumerate(placed, 1) if not found.is_trusted)
        return Geometry(gaussians, viewmats, depths, confidences, unplaced)


def _levels(tokens: Tokens) -> Levels:
    return tokens.maps(0), tokens.maps(1), tokens.maps(2), tokens.maps(3)
