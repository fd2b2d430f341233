"""Published checkpoints: which they are, what they call our tensors, and what of them is not used.

Names are translated from ours to theirs, so that a checkpoint is judged by what the network needs.
`@i` after a name says: the i-th third of the rows, where theirs keeps query, key and value together.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

COPY = "grouping_"
"""Before the name of a module: a copy of it that the grouping alone reads."""
Rule = tuple[str, str | Callable[[re.Match], str]]


@dataclass(frozen=True)
class Origin:
    """A kind of checkpoint.

    title: for people. part: what our file of it is called. marker: a tensor that only this kind
    has. modules: of the network, which it fills. rules: our names to theirs, in order. unused:
    regular expressions of its tensors that nothing here reads. tolerated: of tensors that are unknown
    here and change nothing of what is read; who imports them is told. inside: the checkpoint of which it
    carries a part, under our names with `COPY` before them.
    """

    name: str
    title: str
    part: str
    marker: str
    modules: tuple[str, ...]
    rules: tuple[Rule, ...]
    unused: tuple[str, ...]
    tolerated: tuple[str, ...] = ()
    inside: "Origin | None" = None

    def theirs(self, key: str) -> tuple[str, int | None]:
        """Their name of our tensor, and which third of its rows (None: all)."""
        if self.inside is not None and key.startswith(COPY):
            return self.inside.theirs(key.removeprefix(COPY))
        for pattern, replacement in self.rules:
            key = re.sub(pattern, replacement, key)
        name, _, third = key.partition("@")
        if not third:
            return name, None
        return name + third[1:], int(third[0])

    def ignores(self, name: str) -> bool:
        return any(re.fullmatch(pattern, name) for pattern in self.unused)

    def tolerates(self, name: str) -> bool:
        return any(re.fullmatch(pattern, name) for pattern in self.tolerated)


def _counting_rule(pattern: str, form: str) -> Rule:
    """A rule whose first group is a number that counts from 1 on their side."""
    return pattern, lambda match: form.format(int(match[1]) + 1)


_BLOCKS: tuple[Rule, ...] = (
    (r"\.attn\.query\.(\w+)", r".attn.qkv@0.\1"),
    (r"\.attn\.key\.(\w+)", r".attn.qkv@1.\1"),
    (r"\.attn\.value\.(\w+)", r".attn.qkv@2.\1"),
    (r"\.attn\.out\.", ".attn.proj."),
    (r"\.mlp\.0\.", ".mlp.fc1."),
    (r"\.mlp\.2\.", ".mlp.fc2."),
)
_FUSION: tuple[Rule, ...] = (
    (r"(refinenet\d)\.lateral\.", r"\1.resConfUnit1."),
    (r"(refinenet\d)\.mix\.", r"\1.resConfUnit2."),
    (r"(refinenet\d)\.out\.", r"\1.out_conv."),
)
_DPT: tuple[Rule, ...] = (
    (r"\.dpt\.project\.(\d)\.", r".dpt.act_postprocess.\1.0."),
    (r"\.dpt\.resize\.(\d)\.", r".dpt.act_postprocess.\1.1."),
    _counting_rule(r"\.dpt\.level\.(\d)\.", ".dpt.scratch.layer{}_rn."),
    _counting_rule(r"\.dpt\.fuse\.(\d)\.", ".dpt.scratch.refinenet{}."),
    *_FUSION,
    (r"\.dpt\.shortcut\.", ".dpt.input_merger.0."),
)
_UNUSED_DPT = (
    r".*\.dpt\.scratch\.layer_rn\.\d\.weight",  # a second name of layer{1..4}_rn
    r".*\.scratch\.refinenet4\.resConfUnit1\..*",  # nothing comes in at the coarsest level
)

NOPOSPLAT = Origin(
    name="noposplat",
    title="NoPoSplat",
    part="geometry",
    marker="encoder.backbone.intrinsic_encoder.weight",
    modules=("encoder", "decoder", "point_heads", "gaussian_heads"),
    rules=(
        (r"^encoder\.patch\.", "encoder.backbone.patch_embed.proj."),
        (r"^encoder\.intrinsics\.", "encoder.backbone.intrinsic_encoder."),
        (r"^encoder\.blocks\.", "encoder.backbone.enc_blocks."),
        (r"^encoder\.norm\.", "encoder.backbone.enc_norm."),
        (r"^decoder\.embed\.", "encoder.backbone.decoder_embed."),
        (r"^decoder\.first\.", "encoder.backbone.dec_blocks."),
        (r"^decoder\.other\.", "encoder.backbone.dec_blocks2."),
        (r"^decoder\.norm\.", "encoder.backbone.dec_norm."),
        (r"\.cross\.(q|k|v)[a-z]+\.", r".cross_attn.proj\1."),
        (r"\.cross\.out\.", ".cross_attn.proj."),
        (r"\.norm_memory\.", ".norm_y."),
        *_BLOCKS,
        _counting_rule(r"^point_heads\.(\d)\.(?:dpt\.)?", "encoder.downstream_head{}.dpt."),
        (r"^gaussian_heads\.0\.(?:dpt\.)?", "encoder.gaussian_param_head.dpt."),
        (r"^gaussian_heads\.1\.(?:dpt\.)?", "encoder.gaussian_param_head2.dpt."),
        *_DPT,
        (r"(downstream_head\d\.dpt)\.narrow\.", r"\1.head.0."),
        (r"(downstream_head\d\.dpt)\.mix\.", r"\1.head.2."),
        (r"(gaussian_param_head2?\.dpt)\.mix\.", r"\1.head.0."),
        (r"(head[12]?\.dpt)\.out\.", r"\1.head.4."),
    ),
    unused=(
        *_UNUSED_DPT,
        r"encoder\.backbone\.mask_token",
        r"(losses|decoder|distiller)\..*",  # what only training and drawing need
    ),
)

LSEG = Origin(
    name="lseg",
    title="LSeg",
    part="language",
    marker="pretrained.act_postprocess1.0.project.0.weight",
    modules=("language_head",),
    rules=(
        (r"^language_head\.vit\.patch\.", "pretrained.model.patch_embed.proj."),
        (r"^language_head\.vit\.class_token$", "pretrained.model.cls_token"),
        (r"^language_head\.vit\.places$", "pretrained.model.pos_embed"),
        (r"^language_head\.vit\.", "pretrained.model."),
        *_BLOCKS,
        _counting_rule(r"^language_head\.readout\.(\d)\.", "pretrained.act_postprocess{}.0.project.0."),
        _counting_rule(r"^language_head\.project\.(\d)\.", "pretrained.act_postprocess{}.3."),
        _counting_rule(r"^language_head\.resize\.(\d)\.", "pretrained.act_postprocess{}.4."),
        _counting_rule(r"^language_head\.level\.(\d)\.", "scratch.layer{}_rn."),
        _counting_rule(r"^language_head\.fuse\.(\d)\.", "scratch.refinenet{}."),
        (r"^language_head\.out\.", "scratch.head1."),
        *_FUSION,
        (r"(resConfUnit\d)\.norm(\d)\.", r"\1.bn\2."),
    ),
    unused=(
        r"clip_pretrained\..*",  # CLIP itself, which `clip_of` takes
        r"pretrained\.model\.(norm|head|fc_norm)\..*",  # tokens are read before them
        r"scratch\.refinenet4\.resConfUnit1\..*",
        r"logit_scale",
    ),
)

LANGFLASH = Origin(
    name="langflash",
    title="LangFlash's released grouping",
    part="grouping",
    marker="query_pos.weight",
    modules=("scratch", "grouping", "grouping_encoder", "grouping_decoder"),
    rules=(
        _counting_rule(r"^scratch\.(\d)\.(?:dpt\.)?", "encoder.scratch_head{}.dpt."),
        *_DPT,
        (r"^grouping\.patterns$", "query.weight"),
        (r"^grouping\.positions$", "query_pos.weight"),
        (r"^grouping\.layers\.", "prefuse.dec1."),
        (r"^grouping\.scores\.(\d+)\.0\.", r"prefuse.iou_head.\1.fc1."),
        (r"^grouping\.scores\.(\d+)\.2\.", r"prefuse.iou_head.\1.fc2."),
        (r"^grouping\.mask_mlp\.0\.", "prefuse.mask_heads.5.fc1."),  # the only one that is called
        (r"^grouping\.mask_mlp\.2\.", "prefuse.mask_heads.5.fc2."),
        (r"\.attn\.query\.weight", ".attn.in_proj_weight@0"),
        (r"\.attn\.key\.weight", ".attn.in_proj_weight@1"),
        (r"\.attn\.value\.weight", ".attn.in_proj_weight@2"),
        (r"\.attn\.out\.", ".attn.out_proj."),
        (r"\.cross\.query\.weight", ".cross_attns.0.cross_attn.in_proj_weight@0"),
        (r"\.cross\.key\.weight", ".cross_attns.0.cross_attn.in_proj_weight@1"),
        (r"\.cross\.value\.weight", ".cross_attns.0.cross_attn.in_proj_weight@2"),
        (r"\.cross\.out\.", ".cross_attns.0.cross_attn.out_proj."),
        (r"\.norm2\.", ".cross_attns.0.norm2."),
        (r"\.norm_memory\.", ".cross_attns.0.norm_y."),
        (r"\.mlp\.0\.", ".mlp.fc1."),
        (r"\.mlp\.2\.", ".mlp.fc2."),
    ),
    unused=(
        *_UNUSED_DPT,
        r"prefuse\.lang_head\..*",  # a closed set of classes, read by nobody
        r"prefuse\.mask_heads\.[0-4]\..*",
        r"(fuse|encoder2|decoder|losses|distiller)\..*",
        r"encoder\.(downstream_head\d|gaussian_param_head2?)\..*",  # of its NoPoSplat the backbone is read
        r"encoder\.backbone\.mask_token",
    ),
    tolerated=(
        r".*\b(exist_head|to1|atten1)\b.*",  # tried and given up by its authors
        r"(?!query|prefuse\.dec1\.|encoder\.(backbone|scratch_head\d)\.).*",  # so does their code
    ),
    inside=NOPOSPLAT,
)

ORIGINS = (LANGFLASH, NOPOSPLAT, LSEG)
"""In the order in which they are recognised: the first carries a whole NoPoSplat inside."""
