"""Slow float64 twins of the published networks, on state dicts of their own layout.

Written from the papers and the layout of the public checkpoints, for tests only: plain functions
of a dictionary, no module, no code shared with the network under test. `draw_*` make random
state dicts of any size; gains keep signals near 1 through all layers, so that errors show.
"""

import math

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.network.encoders.mobile_sam import MobileSamEncoder
from langflash_core.network.presets import PointMaps
from langflash_core.network.semantics.mobile_sam.model import MobileSam

State = dict[str, Tensor]


class Drawer:
    """Random tensors by name, float32 as in a file."""

    def __init__(self, seed: int):
        self.generator = torch.Generator().manual_seed(seed)
        self.state: State = {}

    def normal(self, name: str, *shape: int, gain: float = 1.0, mean: float = 0.0) -> None:
        self.state[name] = mean + gain * torch.randn(*shape, generator=self.generator)

    def linear(self, name: str, inputs: int, outputs: int, *, bias: bool = True, gain: float = 1.0) -> None:
        self.normal(f"{name}.weight", outputs, inputs, gain=gain / math.sqrt(inputs))
        if bias:
            self.normal(f"{name}.bias", outputs, gain=0.1)

    def conv(self, name: str, inputs: int, outputs: int, side: int, *, bias: bool = True) -> None:
        self.normal(f"{name}.weight", outputs, inputs, side, side, gain=1 / math.sqrt(inputs * side * side))
        if bias:
            self.normal(f"{name}.bias", outputs, gain=0.1)

    def grow(self, name: str, channels: int, side: int) -> None:
        """A transposed convolution whose stride is its side."""
        self.normal(f"{name}.weight", channels, channels, side, side, gain=1 / math.sqrt(channels))
        self.normal(f"{name}.bias", channels, gain=0.1)

    def norm(self, name: str, channels: int) -> None:
        self.normal(f"{name}.weight", channels, gain=0.2, mean=1.0)
        self.normal(f"{name}.bias", channels, gain=0.1)

    def batch_norm(self, name: str, channels: int) -> None:
        self.norm(name, channels)
        self.normal(f"{name}.running_mean", channels, gain=0.1)
        self.state[f"{name}.running_var"] = 0.5 + torch.rand(channels, generator=self.generator)
        self.state[f"{name}.num_batches_tracked"] = torch.tensor(7)

    def mlp(self, name: str, dim: int, hidden: int, out: int) -> None:
        self.linear(f"{name}.fc1", dim, hidden)
        self.linear(f"{name}.fc2", hidden, out)

    def vit_block(self, name: str, dim: int) -> None:
        self.norm(f"{name}.norm1", dim)
        self.linear(f"{name}.attn.qkv", dim, 3 * dim)
        self.linear(f"{name}.attn.proj", dim, dim)
        self.norm(f"{name}.norm2", dim)
        self.mlp(f"{name}.mlp", dim, 4 * dim, dim)

    def dpt(self, name: str, sizes: PointMaps) -> None:
        """A DPT adapter, with its aliases and its unused unit."""
        dims, f = sizes.dpt_dims, sizes.dpt_feature
        tokens = (sizes.encoder_dim, *(3 * (sizes.decoder_dim,)))
        for i, (t, d) in enumerate(zip(tokens, dims, strict=True)):
            self.conv(f"{name}.act_postprocess.{i}.0", t, d, 1)
        self.grow(f"{name}.act_postprocess.0.1", dims[0], 4)
        self.grow(f"{name}.act_postprocess.1.1", dims[1], 2)
        self.conv(f"{name}.act_postprocess.3.1", dims[3], dims[3], 3)
        for i, d in enumerate(dims):
            self.conv(f"{name}.scratch.layer{i + 1}_rn", d, f, 3, bias=False)
            self.state[f"{name}.scratch.layer_rn.{i}.weight"] = self.state[
                f"{name}.scratch.layer{i + 1}_rn.weight"
            ]
            self.conv(f"{name}.scratch.refinenet{i + 1}.out_conv", f, f, 1)
            for unit in (1, 2):
                for conv in (1, 2):
                    self.conv(f"{name}.scratch.refinenet{i + 1}.resConfUnit{unit}.conv{conv}", f, f, 3)


def draw_noposplat(sizes: PointMaps, seed: int = 0) -> State:
    """A NoPoSplat state dict, keys as in its checkpoints."""
    d = Drawer(seed)
    e, c, back = sizes.encoder_dim, sizes.decoder_dim, "encoder.backbone"
    d.normal(f"{back}.mask_token", 1, 1, c)
    d.conv(f"{back}.patch_embed.proj", 3, e, sizes.patch)
    for i in range(sizes.encoder_depth):
        d.vit_block(f"{back}.enc_blocks.{i}", e)
    d.norm(f"{back}.enc_norm", e)
    d.linear(f"{back}.decoder_embed", e, c)
    for stack in ("dec_blocks", "dec_blocks2"):
        for i in range(sizes.decoder_depth):
            name = f"{back}.{stack}.{i}"
            d.vit_block(name, c)
            d.norm(f"{name}.norm3", c)
            d.norm(f"{name}.norm_y", c)
            for part in ("projq", "projk", "projv", "proj"):
                d.linear(f"{name}.cross_attn.{part}", c, c)
    d.norm(f"{back}.dec_norm", c)
    d.linear(f"{back}.intrinsic_encoder", 9, e)
    f = sizes.dpt_feature
    for head in ("downstream_head1", "downstream_head2"):
        name = f"encoder.{head}.dpt"
        d.dpt(name, sizes)
        d.conv(f"{name}.head.0", f, f // 2, 3)
        d.conv(f"{name}.head.2", f // 2, f // 2, 3)
        d.conv(f"{name}.head.4", f // 2, 3, 1)
    for head in ("gaussian_param_head", "gaussian_param_head2"):
        name = f"encoder.{head}.dpt"
        d.dpt(name, sizes)
        d.conv(f"{name}.input_merger.0", 3, f, 7)
        d.conv(f"{name}.head.0", f, f, 3, bias=False)
        d.conv(f"{name}.head.4", f, 83, 1)
    return d.state


def draw_lseg(sizes: PointMaps, channels: int, seed: int = 0) -> State:
    """An LSeg state dict as Lightning saves it, a little of its CLIP included."""
    d, t = Drawer(seed), sizes.language
    m = "net.pretrained.model"
    d.normal(f"{m}.cls_token", 1, 1, t.dim)
    d.normal(f"{m}.pos_embed", 1, t.trained_grid**2 + 1, t.dim)
    d.conv(f"{m}.patch_embed.proj", 3, t.dim, t.patch)
    for i in range(t.depth):
        d.vit_block(f"{m}.blocks.{i}", t.dim)
    d.norm(f"{m}.norm", t.dim)
    d.linear(f"{m}.head", t.dim, 10)
    f = t.dpt_feature
    for i, n in enumerate(t.dpt_dims):
        post = f"net.pretrained.act_postprocess{i + 1}"
        d.linear(f"{post}.0.project.0", 2 * t.dim, t.dim)
        d.conv(f"{post}.3", t.dim, n, 1)
        d.conv(f"net.scratch.layer{i + 1}_rn", n, f, 3, bias=False)
        d.conv(f"net.scratch.refinenet{i + 1}.out_conv", f, f, 1)
        for unit in (1, 2):
            name = f"net.scratch.refinenet{i + 1}.resConfUnit{unit}"
            for conv in (1, 2):
                d.conv(f"{name}.conv{conv}", f, f, 3, bias=False)
                d.batch_norm(f"{name}.bn{conv}", f)
    d.grow("net.pretrained.act_postprocess1.4", t.dpt_dims[0], 4)
    d.grow("net.pretrained.act_postprocess2.4", t.dpt_dims[1], 2)
    d.conv("net.pretrained.act_postprocess4.4", t.dpt_dims[3], t.dpt_dims[3], 3)
    d.conv("net.scratch.head1", f, channels, 1)
    d.normal("net.clip_pretrained.positional_embedding", 7, 5)
    return d.state


def draw_langflash(sizes: PointMaps, seed: int = 0) -> State:
    """The released semantic checkpoint: a NoPoSplat, two scratch heads, queries and two decoders."""
    d, n = Drawer(seed + 1), sizes.grouping_dim
    for head in ("scratch_head1", "scratch_head2"):
        d.dpt(f"encoder.{head}.dpt", sizes)
        d.conv(f"encoder.{head}.dpt.input_merger.0", 3, sizes.dpt_feature, 7)
    d.normal("query.weight", sizes.num_queries, n)
    d.normal("query_pos.weight", sizes.num_queries, n)
    for decoder in ("fuse", "prefuse"):
        for i in range(sizes.grouping_layers):
            block = f"{decoder}.dec1.{i}"
            d.norm(f"{block}.norm1", n)
            cross = f"{block}.cross_attns.0"
            for attention in (f"{block}.attn", f"{cross}.cross_attn"):
                d.normal(f"{attention}.in_proj_weight", 3 * n, n, gain=1 / math.sqrt(n))
                d.normal(f"{attention}.out_proj.weight", n, n, gain=1 / math.sqrt(n))
            d.norm(f"{cross}.norm2", n)
            d.norm(f"{cross}.norm_y", n)
            d.norm(f"{block}.norm3", n)
            d.mlp(f"{block}.mlp", n, 4 * n, n)
            d.mlp(f"{decoder}.iou_head.{i}", n, n, 1)
            d.mlp(f"{decoder}.lang_head.{i}", n, n, 37)
            d.mlp(f"{decoder}.mask_heads.{i}", n, n, sizes.dpt_feature)
    return draw_noposplat(sizes, seed) | d.state


def doubled(state: State) -> State:
    """Float64, for the twins."""
    return {name: value.double() for name, value in state.items()}


# -- pieces ---------------------------------------------------------------------------------------


def _linear(s: State, name: str, x: Tensor) -> Tensor:
    return x @ s[f"{name}.weight"].T + s.get(f"{name}.bias", torch.zeros((), dtype=x.dtype))


def _layer_norm(s: State, name: str, x: Tensor, eps: float) -> Tensor:
    centred = x - x.mean(-1, keepdim=True)
    variance = (centred**2).mean(-1, keepdim=True)
    return centred / (variance + eps).sqrt() * s[f"{name}.weight"] + s[f"{name}.bias"]


def _conv(s: State, name: str, x: Tensor, stride: int = 1) -> Tensor:
    weight = s[f"{name}.weight"]
    return F.conv2d(x, weight, s.get(f"{name}.bias"), stride, weight.shape[-1] // 2)


def _turn(x: Tensor, positions: Tensor, base: float = 100.0) -> Tensor:
    """Rotary codes, written as complex numbers: pair (j, j + D/4) of each axis turns by its rate."""
    out = []
    for axis, half in enumerate(x.chunk(2, -1)):  # rows, then columns
        real, imag = half.chunk(2, -1)
        rates = base ** (-torch.arange(real.shape[-1], dtype=x.dtype) / real.shape[-1])
        turned = torch.complex(real, imag) * torch.exp(1j * positions[:, axis, None] * rates)
        out += [turned.real, turned.imag]
    return torch.cat(out, -1)


def _attend(q: Tensor, k: Tensor, v: Tensor, heads: int, places=None) -> Tensor:
    """(B, n, C); places: positions of queries and keys, (n, 2) and (m, 2)."""
    answers = []
    for qh, kh, vh in zip(q.chunk(heads, -1), k.chunk(heads, -1), v.chunk(heads, -1), strict=True):
        if places is not None:
            qh, kh = _turn(qh, places[0]), _turn(kh, places[1])
        answers.append((qh @ kh.transpose(1, 2) / qh.shape[-1] ** 0.5).softmax(-1) @ vh)
    return torch.cat(answers, -1)


def _mlp(s: State, name: str, x: Tensor) -> Tensor:
    hidden = _linear(s, f"{name}.fc1", x)
    return _linear(s, f"{name}.fc2", hidden * 0.5 * (1 + torch.erf(hidden / math.sqrt(2))))


def _self_attention(s: State, name: str, x: Tensor, heads: int, places) -> Tensor:
    normed = _layer_norm(s, f"{name}.norm1", x, 1e-6)
    q, k, v = _linear(s, f"{name}.attn.qkv", normed).chunk(3, -1)
    both = None if places is None else (places, places)
    return x + _linear(s, f"{name}.attn.proj", _attend(q, k, v, heads, both))


def _vit_block(s: State, name: str, x: Tensor, heads: int, places=None) -> Tensor:
    x = _self_attention(s, name, x, heads, places)
    return x + _mlp(s, f"{name}.mlp", _layer_norm(s, f"{name}.norm2", x, 1e-6))


def _cross_block(s: State, name: str, x: Tensor, memory: Tensor, heads: int, places, memory_places) -> Tensor:
    x = _self_attention(s, name, x, heads, places)
    m, q = _layer_norm(s, f"{name}.norm_y", memory, 1e-6), _layer_norm(s, f"{name}.norm2", x, 1e-6)
    cross = f"{name}.cross_attn"
    read = _attend(
        _linear(s, f"{cross}.projq", q), _linear(s, f"{cross}.projk", m), _linear(s, f"{cross}.projv", m),
        heads, (places, memory_places),
    )  # fmt: skip
    x = x + _linear(s, f"{cross}.proj", read)
    return x + _mlp(s, f"{name}.mlp", _layer_norm(s, f"{name}.norm3", x, 1e-6))


def _double(x: Tensor) -> Tensor:
    return F.interpolate(x, scale_factor=2, mode="bilinear", align_corners=True)


def _unit(s: State, name: str, x: Tensor) -> Tensor:
    return x + _conv(s, f"{name}.conv2", _conv(s, f"{name}.conv1", x.relu()).relu())


def _normed_unit(s: State, name: str, x: Tensor) -> Tensor:
    def norm(which: str, y: Tensor) -> Tensor:
        weight, bias, mean, variance = (
            s[f"{name}.{which}.{part}"][:, None, None]
            for part in ("weight", "bias", "running_mean", "running_var")
        )
        return (y - mean) / (variance + 1e-5).sqrt() * weight + bias

    return x + norm("bn2", _conv(s, f"{name}.conv2", norm("bn1", _conv(s, f"{name}.conv1", x.relu())).relu()))


def _fused(s: State, name: str, levels: list[Tensor], unit) -> list[Tensor]:
    """path_4, path_3, path_2, path_1: doubled before the 1x1 convolution, as published."""
    paths = [
        _conv(
            s, f"{name}.refinenet4.out_conv", _double(unit(s, f"{name}.refinenet4.resConfUnit2", levels[3]))
        )
    ]
    paths[0] = paths[0][..., : levels[2].shape[-2], : levels[2].shape[-1]]
    for i in (3, 2, 1):
        block = f"{name}.refinenet{i}"
        joined = paths[-1] + unit(s, f"{block}.resConfUnit1", levels[i - 1])
        paths.append(_conv(s, f"{block}.out_conv", _double(unit(s, f"{block}.resConfUnit2", joined))))
    return paths


def _dpt_paths(s: State, name: str, tokens: list[Tensor], grid: tuple[int, int]) -> list[Tensor]:
    levels = []
    for i, t in enumerate(tokens):
        post = f"{name}.act_postprocess.{i}"
        x = _conv(s, f"{post}.0", t.transpose(1, 2).reshape(len(t), -1, *grid))
        if i < 2:
            x = F.conv_transpose2d(x, s[f"{post}.1.weight"], s[f"{post}.1.bias"], stride=4 // (i + 1))
        if i == 3:
            x = _conv(s, f"{post}.1", x, stride=2)
        levels.append(_conv(s, f"{name}.scratch.layer{i + 1}_rn", x))
    return _fused(s, f"{name}.scratch", levels, _unit)


# -- NoPoSplat ------------------------------------------------------------------------------------


def decoded(s: State, images: Tensor, Ks: Tensor, sizes: PointMaps) -> tuple[list[Tensor], tuple[int, int]]:
    """Token lists of one scene: encoder output, then every decoder layer; (V, h*w, C) each.

    images: (V, 3, H, W) in [-1, 1]. Ks: (V, 3, 3), normalised.
    """
    back, (height, width) = "encoder.backbone", images.shape[-2:]
    grid = (height // sizes.patch, width // sizes.patch)
    weight = s[f"{back}.patch_embed.proj.weight"]
    x = (
        F.conv2d(images, weight, s[f"{back}.patch_embed.proj.bias"], stride=sizes.patch)
        .flatten(2)
        .transpose(1, 2)
    )
    x = torch.cat((x, _linear(s, f"{back}.intrinsic_encoder", Ks.flatten(1))[:, None]), 1)
    places = [[float(i // grid[1]), float(i % grid[1])] for i in range(grid[0] * grid[1])]
    positions = torch.tensor([*places, [float(grid[0]), 0.0]], dtype=x.dtype)
    for i in range(sizes.encoder_depth):
        x = _vit_block(s, f"{back}.enc_blocks.{i}", x, sizes.encoder_heads, positions)
    x = _layer_norm(s, f"{back}.enc_norm", x, 1e-6)
    lists, y = [x], _linear(s, f"{back}.decoder_embed", x)
    for i in range(sizes.decoder_depth):
        fresh = []
        for v in range(len(y)):
            others = torch.cat([y[u] for u in range(len(y)) if u != v])[None]
            stack = f"{back}.dec_blocks2.{i}" if v else f"{back}.dec_blocks.{i}"
            around = positions.repeat(len(y) - 1, 1)
            fresh.append(_cross_block(s, stack, y[v : v + 1], others, sizes.decoder_heads, positions, around))
        y = torch.cat(fresh)
        lists.append(y)
    lists[-1] = _layer_norm(s, f"{back}.dec_norm", y, 1e-6)
    return [tokens[:, :-1] for tokens in lists], grid


def _hooked(lists: list[Tensor], view: int, sizes: PointMaps) -> list[Tensor]:
    return [lists[i][view : view + 1] for i in (0, *sizes.decoder_hooks)]


def noposplat(s: State, images: Tensor, Ks: Tensor, sizes: PointMaps) -> dict[str, Tensor]:
    """means (V, H, W, 3), covariances (V, H, W, 3, 3), harmonics (V, H, W, 3, 25), opacities (V, H, W).

    Laid out by pixel. (The public code flattens the means of *portrait* pictures column by column
    and everything else row by row, so that they no longer belong together; compared here is what
    its heads give at each pixel.)
    """
    lists, grid = decoded(s, images, Ks, sizes)
    means, raws = [], []
    for v in range(len(images)):
        tokens = _hooked(lists, v, sizes)
        name = f"encoder.downstream_head{2 if v else 1}.dpt"
        x = _double(_conv(s, f"{name}.head.0", _dpt_paths(s, name, tokens, grid)[3]))
        x = _conv(s, f"{name}.head.4", _conv(s, f"{name}.head.2", x).relu())[0].movedim(0, -1)
        distance = x.norm(dim=-1, keepdim=True)
        means.append(x / distance.clamp_min(1e-8) * (distance.exp() - 1))
        name = f"encoder.gaussian_param_head{2 if v else ''}.dpt"
        x = _double(_dpt_paths(s, name, tokens, grid)[3])
        x = x + _conv(s, f"{name}.input_merger.0", images[v : v + 1]).relu()
        raws.append(_conv(s, f"{name}.head.4", _conv(s, f"{name}.head.0", x).relu())[0].movedim(0, -1))
    raw = torch.stack(raws)
    scales = (0.001 * torch.log1p(raw[..., 1:4].exp())).clamp_max(0.3)
    i, j, k, r = raw[..., 4:8].unbind(-1)
    square = i * i + j * j + k * k + r * r
    rotation = torch.stack(
        (
            square - 2 * (j * j + k * k), 2 * (i * j - k * r), 2 * (i * k + j * r),
            2 * (i * j + k * r), square - 2 * (i * i + k * k), 2 * (j * k - i * r),
            2 * (i * k - j * r), 2 * (j * k + i * r), square - 2 * (i * i + j * j),
        ), -1,
    ).unflatten(-1, (3, 3)) / square[..., None, None]  # fmt: skip
    damping = torch.tensor([1.0] + [0.1 * 0.25**d for d in range(1, 5) for _ in range(2 * d + 1)]).double()
    return {
        "means": torch.stack(means),
        "covariances": rotation @ torch.diag_embed(scales**2) @ rotation.transpose(-1, -2),
        "harmonics": raw[..., 8:].unflatten(-1, (3, 25)) * damping,
        "opacities": 1 / (1 + (-raw[..., 0]).exp()),
    }


# -- LSeg -----------------------------------------------------------------------------------------


def lseg(s: State, images: Tensor, sizes: PointMaps) -> Tensor:
    """head1's output (n, C, H/2, W/2); images (n, 3, H, W) in [-1, 1]; keys without `net.`."""
    t, m = sizes.language, "pretrained.model"
    grid = (images.shape[-2] // t.patch, images.shape[-1] // t.patch)
    x = F.conv2d(images, s[f"{m}.patch_embed.proj.weight"], s[f"{m}.patch_embed.proj.bias"], stride=t.patch)
    x = torch.cat((s[f"{m}.cls_token"].expand(len(x), -1, -1), x.flatten(2).transpose(1, 2)), 1)
    learned = s[f"{m}.pos_embed"]
    square = learned[:, 1:].transpose(1, 2).reshape(1, -1, t.trained_grid, t.trained_grid)
    resized = F.interpolate(square, size=grid, mode="bilinear").flatten(2).transpose(1, 2)
    x = x + torch.cat((learned[:, :1], resized), 1)
    levels = []
    for i in range(t.depth):
        x = _vit_block(s, f"{m}.blocks.{i}", x, t.heads)
        if i not in t.hooks:
            continue
        which = t.hooks.index(i)
        post = f"pretrained.act_postprocess{which + 1}"
        joined = torch.cat((x[:, 1:], x[:, :1].expand_as(x[:, 1:])), -1)
        y = F.gelu(_linear(s, f"{post}.0.project.0", joined)).transpose(1, 2).reshape(len(x), -1, *grid)
        y = _conv(s, f"{post}.3", y)
        if which < 2:
            y = F.conv_transpose2d(y, s[f"{post}.4.weight"], s[f"{post}.4.bias"], stride=4 // (which + 1))
        if which == 3:
            y = _conv(s, f"{post}.4", y, stride=2)
        levels.append(_conv(s, f"scratch.layer{which + 1}_rn", y))
    return _conv(s, "scratch.head1", _fused(s, "scratch", levels, _normed_unit)[3])


# -- the released grouping ------------------------------------------------------------------------


def grouping(s: State, images: Tensor, Ks: Tensor, sizes: PointMaps) -> tuple[Tensor, Tensor]:
    """Mask logits (N, V, H, W) and predicted IoU logits (N,) of one scene, images in [-1, 1]."""
    lists, grid = decoded(s, images, Ks, sizes)
    scales: list[list[Tensor]] = [[], [], []]
    maps = []
    for v in range(len(images)):
        name = f"encoder.scratch_head{2 if v else 1}.dpt"
        paths = _dpt_paths(s, name, _hooked(lists, v, sizes), grid)
        for scale, path in zip(scales, paths, strict=False):
            scale.append(path[0].flatten(1).T)
        maps.append(_double(paths[3])[0] + _conv(s, f"{name}.input_merger.0", images[v : v + 1])[0].relu())
    query, place = s["query.weight"][None], s["query_pos.weight"][None]
    masks = torch.zeros((), dtype=query.dtype)
    for i in range(sizes.grouping_layers):
        memory = torch.cat(scales[i // 2])[None]
        n, c = memory.shape[1:]
        angle = torch.arange(n)[:, None] / 10000.0 ** (torch.arange(0, c, 2) / c)
        code = torch.zeros(n, c, dtype=query.dtype)
        code[:, 0::2], code[:, 1::2] = angle.sin(), angle.cos()
        block = f"prefuse.dec1.{i}"
        x = _layer_norm(s, f"{block}.norm1", query, 1e-5)
        query = query + _packed(s, f"{block}.attn", x + place, x + place, x, sizes.grouping_heads)
        cross = f"{block}.cross_attns.0"
        m, x = _layer_norm(s, f"{cross}.norm_y", memory, 1e-5), _layer_norm(s, f"{cross}.norm2", query, 1e-5)
        query = query + _packed(s, f"{cross}.cross_attn", x + place, m + code, m, sizes.grouping_heads)
        query = query + _mlp(s, f"{block}.mlp", _layer_norm(s, f"{block}.norm3", query, 1e-5))
        weights = _mlp(s, "prefuse.mask_heads.5", query)[0]
        masks = masks + torch.einsum("nf,vfhw->nvhw", weights, torch.stack(maps))
    return masks, _mlp(s, "prefuse.iou_head.5", query)[0, :, 0]


def _packed(s: State, name: str, q: Tensor, k: Tensor, v: Tensor, heads: int) -> Tensor:
    """torch's MultiheadAttention layout without biases."""
    wq, wk, wv = s[f"{name}.in_proj_weight"].chunk(3)
    return _attend(q @ wq.T, k @ wk.T, v @ wv.T, heads) @ s[f"{name}.out_proj.weight"].T


def _by_name(name: str, shape: torch.Size) -> torch.Tensor:
    """Numbers that follow from a published name alone."""
    if name.endswith("num_batches_tracked"):
        return torch.zeros((), dtype=torch.int64)
    count = torch.arange(shape.numel(), dtype=torch.float64)
    waves = torch.cos(0.37 * count + sum(map(ord, name))).reshape(shape)
    if name.endswith("running_var"):
        return 1.5 + waves
    gain = len(shape) == 1 and name.endswith("weight")
    return 1 + 0.1 * waves if gain else waves * (2 / max(1, shape[1:].numel())) ** 0.5


def draw_mobile_sam() -> dict[str, torch.Tensor]:
    """MobileSAM's encoder under its published names, and two tensors of what is not read of that file."""
    state = {"image_encoder.head.bias": torch.ones(3), "mask_decoder.iou_token.weight": torch.ones(1, 4)}
    for own, value in MobileSamEncoder().state_dict().items():
        state[f"image_encoder.{mobile_sam_name(own)}"] = _by_name(
            mobile_sam_name(own), value.shape
        ).contiguous()
    return state


def mobile_sam_file(sam: MobileSam) -> State:
    """The whole network's tensors as the published file has them, and its classifier, which nobody asks."""
    encoder = "image_encoder."
    state = {
        encoder + mobile_sam_name(name.removeprefix(encoder)) if name.startswith(encoder) else name: value
        for name, value in sam.state_dict().items()
    }
    state |= {f"{encoder}norm_head.{name}": torch.zeros(320) for name in ("weight", "bias")}
    return state | {f"{encoder}head.weight": torch.zeros(1000, 320), f"{encoder}head.bias": torch.zeros(1000)}


def mobile_sam_name(own: str) -> str:
    """What the published file calls a tensor of the encoder.

    What leads to a stage lies at the end of the one before there.
    """
    name = own.removeprefix("body.").replace(".conv.weight", ".c.weight")
    name = name.replace("patch_embed.conv1", "patch_embed.seq.0").replace(
        "patch_embed.conv2", "patch_embed.seq.2"
    )
    for stage in (1, 2, 3):
        name = name.replace(f"stages.{stage}.downsample", f"layers.{stage - 1}.downsample")
    return name.replace("stages.", "layers.")
