"""Sizes of the network. One code path; a preset is data and nothing asks for its name.

Two frozen dataclasses, one per kind of geometry: `GuidedDepth` (matches and depth maps) and
`PointMaps` (points of every pixel in the first camera's frame). What both share is `Preset`.
"""

from dataclasses import dataclass

PRECISIONS = ("auto", "float32", "bfloat16")
AGGREGATIONS = ("lfa", "average", "crops")
"""Ways in which a group gets its vector."""
GROUPINGS = ("queries", "mobile-sam", "sam2")
"""Where groups come from."""


@dataclass(frozen=True)
class Splitting:
    """How finely a scene is cut into parts, and how softly.

    max_parts: K never exceeds it. max_cosine: parts closer than this are one. agreement, meaning:
    what the queries' answer and the language features count for beside the mask map. sharpness: of
    the softmax over the parts.
    """

    max_parts: int = 48
    max_cosine: float = 0.92
    agreement: float = 0.6
    meaning: float = 1.0
    sharpness: float = 15.0


@dataclass(frozen=True)
class MaskFilter:
    """Which of N masks are groups, as the released LangFlash decides it (SAM's recipe).

    min_score: predicted IoU in (0, 1). min_stability: IoU of the mask cut at +-`offset` logits.
    min_area: pixels of all views' mask maps together. max_overlap: IoU above which the mask of
    the lower score goes.
    """

    min_score: float = 0.15
    min_stability: float = 0.8
    offset: float = 0.5
    min_area: int = 200
    max_overlap: float = 0.6


@dataclass(frozen=True)
class LSegSizes:
    """LSeg's image tower: a ViT with a class token, and a DPT with batch norms.

    trained_grid: side of the grid its position codes were trained on. hooks: 0-based blocks.
    """

    dim: int = 1024
    depth: int = 24
    heads: int = 16
    patch: int = 16
    trained_grid: int = 24
    hooks: tuple[int, int, int, int] = (5, 11, 17, 23)
    dpt_dims: tuple[int, int, int, int] = (256, 512, 1024, 1024)
    dpt_feature: int = 256


@dataclass(frozen=True, kw_only=True)
class Preset:
    """What fixes shapes whatever the geometry, and what the paper leaves open: thresholds and weights
    are this project's choice, to be changed with numbers."""

    name: str
    space: str
    """Language space of the dictionary; fixes C."""
    language_dim: int

    patch: int
    encoder_dim: int
    native_area: int
    """Pixels of a photo as the network sees it by default."""
    square: bool = False
    """Photos are cut to their centre square."""

    decoder_dim: int
    decoder_depth: int
    decoder_heads: int
    rope_base: float

    dpt_dims: tuple[int, int, int, int]
    dpt_feature: int
    sh_degree: int

    num_queries: int
    grouping_dim: int
    grouping_layers: int
    grouping_heads: int
    aggregation_blocks: int
    aggregation_heads: int

    tau_exist: float = 0.5
    splitting: Splitting = Splitting()
    eps: float = 1e-6


@dataclass(frozen=True, kw_only=True)
class GuidedDepth(Preset):
    """Depth maps, matches and a plane sweep give the geometry.

    `hooks` are 0-based encoder blocks. The heads read (hook 0, hook 1, decoder middle, decoder
    end): shallow tokens carry edges and correspondence, deep ones layout and meaning.
    """

    encoder_depth: int
    encoder_heads: int
    trained_grid: int
    """Side of the grid that the encoder's position codes were trained on."""
    hooks: tuple[int, int, int, int]
    late_rank: int
    """Of what the matrices of the late halves that photos taught differ from the encoder's by."""
    match_hook: int
    """Index into `hooks` of the tokens that correspondence reads (blocks 3-6 match best)."""
    language_feature: int
    taught_feature: int

    sweep_planes: int
    sweep_range: float
    """Plane-sweep hypotheses span prior depth times exp(+-sweep_range)."""
    sweep_groups: int
    sweep_passes: int
    """How often the sweep is done, each time around the answer before."""
    refiner_widths: tuple[int, int, int]
    """Channels at 4, 2 and 1 times the token grid."""

    semantic_depth: int
    naming_dim: int
    naming_blocks: int
    naming_heads: int
    """Of what corrects atoms by tokens, places and each other."""


@dataclass(frozen=True, kw_only=True)
class PointMaps(Preset):
    """The paper's geometry: a point per pixel, all in the first camera's frame.

    `decoder_hooks`: after how many decoder layers the heads look, besides the encoder's output.
    `mask_filter`: which masks become groups; None: `tau_exist`, as the paper has it.
    `own_grouping`: the grouping reads an encoder and a decoder of its own, since it was trained on others
    than those of the geometry.
    """

    encoder_depth: int
    encoder_heads: int
    decoder_hooks: tuple[int, int, int]
    norm_eps: float = 1e-6
    language: LSegSizes = LSegSizes()
    mask_filter: MaskFilter | None = MaskFilter()
    own_grouping: bool = False


MINI = GuidedDepth(
    name="mini",
    space="minilm",
    language_dim=384,
    patch=14,
    encoder_dim=384,
    encoder_depth=12,
    encoder_heads=6,
    trained_grid=37,
    hooks=(2, 5, 8, 11),
    late_rank=52,
    match_hook=1,
    native_area=224 * 224,
    decoder_dim=256,
    decoder_depth=4,
    decoder_heads=8,
    rope_base=100.0,
    dpt_dims=(48, 96, 128, 192),
    dpt_feature=64,
    language_feature=96,
    taught_feature=256,
    sh_degree=0,
    sweep_planes=24,
    sweep_range=0.45,
    sweep_groups=2,
    sweep_passes=2,
    refiner_widths=(64, 128, 192),
    num_queries=64,
    grouping_dim=128,
    grouping_layers=6,
    grouping_heads=8,
    semantic_depth=4,
    naming_dim=384,
    naming_blocks=2,
    naming_heads=6,
    aggregation_blocks=3,
    aggregation_heads=8,
)

FULL = PointMaps(
    name="full",
    space="clip",
    language_dim=512,
    patch=16,
    encoder_dim=1024,
    encoder_depth=24,
    encoder_heads=16,
    native_area=256 * 256,
    square=True,
    decoder_dim=768,
    decoder_depth=12,
    decoder_heads=12,
    decoder_hooks=(6, 9, 12),
    rope_base=100.0,
    dpt_dims=(96, 192, 384, 768),
    dpt_feature=256,
    sh_degree=4,
    num_queries=256,
    grouping_dim=256,
    grouping_layers=6,
    grouping_heads=8,
    aggregation_blocks=3,
    aggregation_heads=8,
)

PRESETS: dict[str, Preset] = {preset.name: preset for preset in (MINI, FULL)}
