"""Sizes of the network. One code path; a preset is data and nothing asks for its name.

`hooks` are 0-based encoder blocks. The heads read (hook 0, hook 1, decoder middle, decoder
end): shallow tokens carry edges and correspondence, deep ones layout and meaning.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Splitting:
    """How finely a scene is cut into parts, and how softly.

    max_parts: K never exceeds it. max_cosine: parts closer than this are one. agreement: what the
    queries' answer counts for beside the mask map. sharpness: of the softmax over the parts.
    """

    max_parts: int = 48
    max_cosine: float = 0.9
    agreement: float = 0.6
    sharpness: float = 25.0


@dataclass(frozen=True)
class Preset:
    """Everything that fixes shapes, and what the paper leaves open (blueprint section 3)."""

    name: str
    space: str
    """Language space of the dictionary; fixes C."""
    language_dim: int

    encoder: str
    """timm model name."""
    patch: int
    encoder_dim: int
    hooks: tuple[int, int, int, int]
    match_hook: int
    """Index into `hooks` of the tokens that correspondence reads (blocks 3-6 match best)."""
    native_area: int
    """Pixels of a photo as the network sees it by default."""

    decoder_dim: int
    decoder_depth: int
    decoder_heads: int
    rope_base: float

    dpt_dims: tuple[int, int, int, int]
    dpt_feature: int
    language_feature: int
    sh_degree: int

    sweep_planes: int
    sweep_range: float
    """Plane-sweep hypotheses span prior depth times exp(+-sweep_range)."""
    sweep_groups: int
    refiner_widths: tuple[int, int, int]
    """Channels at 4, 2 and 1 times the token grid."""

    num_queries: int
    grouping_dim: int
    grouping_layers: int
    grouping_heads: int
    semantic_depth: int
    aggregation_blocks: int
    aggregation_heads: int

    tau_exist: float = 0.5
    splitting: Splitting = Splitting()
    eps: float = 1e-6


MINI = Preset(
    name="mini",
    space="minilm",
    language_dim=384,
    encoder="vit_small_patch14_dinov2",
    patch=14,
    encoder_dim=384,
    hooks=(2, 5, 8, 11),
    match_hook=1,
    native_area=224 * 224,
    decoder_dim=256,
    decoder_depth=4,
    decoder_heads=8,
    rope_base=100.0,
    dpt_dims=(48, 96, 128, 192),
    dpt_feature=64,
    language_feature=96,
    sh_degree=0,
    sweep_planes=24,
    sweep_range=0.45,
    sweep_groups=2,
    refiner_widths=(64, 128, 192),
    num_queries=64,
    grouping_dim=128,
    grouping_layers=6,
    grouping_heads=8,
    semantic_depth=4,
    aggregation_blocks=3,
    aggregation_heads=8,
)

PRESETS = {MINI.name: MINI}
