"""Transformer blocks. n query tokens, m memory tokens, C channels; pre-norm throughout."""

from collections.abc import Iterable

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

Memory = tuple[Tensor, Tensor]
"""Keys and values of tokens that are read, (B, heads, m, head_dim) each."""


def rope_2d(grid: tuple[int, int], head_dim: int, base: float, *, extra: int = 0) -> Float[Tensor, "2 n d"]:
    """Cosines and sines (2, h*w + extra, head_dim) of rotary codes for patch rows and columns.

    The first half of a head turns with y, the second with x. `extra` tokens after the grid sit
    at (y, x) = (h, 0), where the intrinsics token lives.

    Source: Su et al. 2021 (RoPE), applied per axis as in CroCo v2.
    """
    height, width = grid
    ys, xs = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
    positions = torch.stack((ys, xs), -1).reshape(-1, 2)
    positions = torch.cat((positions, torch.tensor([[height, 0]]).expand(extra, 2))).float()
    quarter = head_dim // 4
    rates = base ** (-torch.arange(quarter) / quarter)
    angles = positions[:, :, None] * rates  # (n, 2, quarter)
    angles = torch.cat((angles, angles), -1).flatten(1)  # (n, head_dim)
    return torch.stack((angles.cos(), angles.sin()))


def rotate(
    tokens: Float[Tensor, "B heads n d"], code: Float[Tensor, "2 n d"]
) -> Float[Tensor, "B heads n d"]:
    """Apply a `rope_2d` code to tokens (B, heads, n, head_dim)."""
    first, second = tokens.unflatten(-1, (2, 2, -1)).unbind(-2)  # (B, heads, n, 2 axes, quarter)
    turned = torch.stack((-second, first), -2).flatten(-3)
    return tokens * code[0].to(tokens) + turned * code[1].to(tokens)


class Attention(nn.Module):
    """Multi-head attention; rotary codes and additive position codes are the caller's choice."""

    def __init__(self, dim: int, heads: int, *, bias: bool = True):
        super().__init__()
        self.heads = heads
        self.query, self.key, self.value = (nn.Linear(dim, dim, bias=bias) for _ in range(3))
        self.out = nn.Linear(dim, dim, bias=bias)

    def forward(
        self,
        query: Float[Tensor, "B n C"],
        key: Float[Tensor, "B m C"],
        value: Float[Tensor, "B m C"],
        codes: tuple[Float[Tensor, "2 n d"], Float[Tensor, "2 m d"]] | None = None,
    ) -> Float[Tensor, "B n C"]:
        """(B, n, C) from queries (B, n, C), keys and values (B, m, C)."""
        own, of_memory = codes if codes is not None else (None, None)
        return self.gather_values(query, self.memory(key, value, of_memory), own)

    def memory(
        self,
        key: Float[Tensor, "B m C"],
        value: Float[Tensor, "B m C"],
        code: Float[Tensor, "2 m d"] | None = None,
    ) -> Memory:
        """What queries read of (B, m, C): one memory serves many."""
        k, v = self._of_heads(self.key(key)), self._of_heads(self.value(value))
        return k if code is None else rotate(k, code), v

    def gather_values(
        self, query: Float[Tensor, "B n C"], memory: Memory, code: Float[Tensor, "2 n d"] | None = None
    ) -> Float[Tensor, "B n C"]:
        """(B, n, C) from queries (B, n, C) and a memory."""
        q = self._of_heads(self.query(query))
        q = q if code is None else rotate(q, code)
        return self.out(F.scaled_dot_product_attention(q, *memory).transpose(1, 2).flatten(2))

    def gathered_in_turn(
        self, query: Float[Tensor, "B n C"], memories: Iterable[Memory]
    ) -> Float[Tensor, "B n C"]:
        """(B, n, C) from queries (B, n, C) and a memory that comes in parts: one of them is held at a time.

        Of every part the largest logit is taken out before exponentials are summed, and sums so far are
        brought to the largest of all (Milakov and Gimelshein 2018): softmax over all parts but for rounding.
        """
        q = self._of_heads(self.query(query))
        top = q.new_full(q.shape[:-1], -torch.inf)
        total, sums = torch.zeros_like(top), torch.zeros_like(q)
        for k, v in memories:
            logits = q @ k.mT * q.shape[-1] ** -0.5  # (B, heads, n, m)
            higher = torch.maximum(top, logits.amax(-1))
            shrunk, shares = (top - higher).exp(), (logits - higher[..., None]).exp()
            total, sums = total * shrunk + shares.sum(-1), sums * shrunk[..., None] + shares @ v
            top = higher
        return self.out((sums / total[..., None]).transpose(1, 2).flatten(2))

    def _of_heads(self, x: Tensor) -> Tensor:
        return x.unflatten(-1, (self.heads, -1)).transpose(1, 2)


class MLP(nn.Sequential):
    """Linear, GELU, Linear."""

    def __init__(self, dim: int, hidden: int, out: int | None = None):
        super().__init__(nn.Linear(dim, hidden), nn.GELU(), nn.Linear(hidden, dim if out is None else out))


class SelfBlock(nn.Module):
    """Self-attention, with rotary codes where there are any, then an MLP."""

    def __init__(self, dim: int, heads: int, eps: float = 1e-5):
        super().__init__()
        self.norm1, self.norm2 = nn.LayerNorm(dim, eps), nn.LayerNorm(dim, eps)
        self.attn, self.mlp = Attention(dim, heads), MLP(dim, 4 * dim)

    def forward(
        self, tokens: Float[Tensor, "B n C"], code: Float[Tensor, "2 n d"] | None = None
    ) -> Float[Tensor, "B n C"]:
        x = self.norm1(tokens)
        tokens = tokens + self.attn(x, x, x, None if code is None else (code, code))
        return tokens + self.mlp(self.norm2(tokens))


class CrossBlock(nn.Module):
    """Self-attention, cross-attention to a memory, MLP; rotary codes on both sides."""

    def __init__(self, dim: int, heads: int, eps: float = 1e-5):
        super().__init__()
        self.norm1, self.norm2, self.norm3, self.norm_memory = (nn.LayerNorm(dim, eps) for _ in range(4))
        self.attn, self.cross, self.mlp = Attention(dim, heads), Attention(dim, heads), MLP(dim, 4 * dim)

    def forward(
        self, tokens: Float[Tensor, "B n C"], memory: Memory, code: Float[Tensor, "2 n d"]
    ) -> Float[Tensor, "B n C"]:
        x = self.norm1(tokens)
        tokens = tokens + self.attn(x, x, x, (code, code))
        tokens = tokens + self.cross.gather_values(self.norm2(tokens), memory, code)
        return tokens + self.mlp(self.norm3(tokens))

    def memory(self, tokens: Float[Tensor, "B m C"], code: Float[Tensor, "2 m d"]) -> Memory:
        """What this block reads of other tokens (B, m, C)."""
        m = self.norm_memory(tokens)
        return self.cross.memory(m, m, code)


class QueryBlock(nn.Module):
    """Learned queries: self-attention among them, cross-attention to a memory, MLP.

    Positions are added to queries and keys, never to values (DETR, Carion et al. 2020).
    """

    def __init__(self, dim: int, heads: int, *, bias: bool = True):
        super().__init__()
        self.norm1, self.norm2, self.norm3, self.norm_memory = (nn.LayerNorm(dim) for _ in range(4))
        self.attn, self.cross = Attention(dim, heads, bias=bias), Attention(dim, heads, bias=bias)
        self.mlp = MLP(dim, 4 * dim)

    def forward(
        self,
        queries: Float[Tensor, "B N d"],
        memory: Float[Tensor, "B M d"],
        query_pos: Float[Tensor, "N d"] | float = 0.0,
        memory_pos: Float[Tensor, "M d"] | float = 0.0,
    ) -> Float[Tensor, "B N d"]:
        queries = self._among_themselves(queries, query_pos)
        m = self.norm_memory(memory)
        queries = queries + self.cross(self.norm2(queries) + query_pos, m + memory_pos, m)
        return queries + self.mlp(self.norm3(queries))

    def in_turn(
        self,
        queries: Float[Tensor, "B N d"],
        memories: Iterable[tuple[Float[Tensor, "B _ d"], Float[Tensor, "_ d"]]],
        query_pos: Float[Tensor, "N d"] | float = 0.0,
    ) -> Float[Tensor, "B N d"]:
        """The same of a memory in parts, each with its positions; one of them is held at a time."""
        queries = self._among_themselves(queries, query_pos)
        normed = ((self.norm_memory(memory), pos) for memory, pos in memories)
        parts = (self.cross.memory(m + pos, m) for m, pos in normed)
        queries = queries + self.cross.gathered_in_turn(self.norm2(queries) + query_pos, parts)
        return queries + self.mlp(self.norm3(queries))

    def _among_themselves(self, queries: Tensor, query_pos: Tensor | float) -> Tensor:
        x = self.norm1(queries)
        return queries + self.attn(x + query_pos, x + query_pos, x)
