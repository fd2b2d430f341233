"""MiniLM-L6-v2: the embedded text tower. Phrases in, 384 unit numbers out, nothing downloaded.

A BERT encoder in torch's own post-norm transformer layers. Its file keeps the big matrices as
int8 rows with one float16 scale per row; the word table stays int8 in memory (12 MB) and is
scaled after lookup. It is a text model: images reach its space only through a network that was
trained to land there.

Source: Reimers and Gurevych 2019 (Sentence-BERT); Wang et al. 2020 (MiniLM); weights and their
checks in assets/licences/minilm_l6_v2.md. Twin: `bert_twin`, tests/language/reference.py (NumPy, float64).
"""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import torch
from jaxtyping import Float, Int, Shaped
from safetensors import SafetensorError
from safetensors.torch import load_file
from tokenizers import Tokenizer
from torch import Tensor, nn
from torch.nn.functional import normalize

from langflash_core.base.resources import asset_path
from langflash_core.base.shipped import check_shipped
from langflash_core.errors import PromptError, WeightsError
from langflash_core.language.settings import MINILM

DIMENSION = 384


class RowInt8Table(nn.Module):
    """An embedding table kept as int8 rows and one scale per row."""

    rows: Int[Tensor, "T C"]
    scales: Float[Tensor, " T"]

    def __init__(self, rows: Int[Tensor, "T C"], scales: Float[Tensor, " T"]) -> None:
        super().__init__()
        self.register_buffer("rows", rows)  # (T, C) int8
        self.register_buffer("scales", scales.float())  # (T,)

    def forward(self, ids: Int[Tensor, "*n"]) -> Float[Tensor, "*n C"]:
        """Float rows (..., C) of int64 ids (...)."""
        return self.rows[ids] * self.scales[ids][..., None]


class MiniLM(nn.Module):
    """The tower: token embeddings, six BERT layers, mean over tokens, unit length."""

    positions: Float[Tensor, "T C"]

    def __init__(self, tensors: dict[str, Shaped[Tensor, "..."]], tokenizer: Tokenizer) -> None:
        super().__init__()
        prefix = "embeddings."
        self.words = RowInt8Table(
            tensors[prefix + "word_embeddings.weight"], tensors[prefix + "word_embeddings.weight.scale"]
        )
        # Every token is of type 0, so its type vector is part of the position vector.
        types = _dense(tensors, prefix + "token_type_embeddings.weight")
        places = _dense(tensors, prefix + "position_embeddings.weight")[: MINILM.max_tokens]
        self.register_buffer("positions", places + types[0])  # (256, C)
        with torch.device("meta"):  # no random initialisation: the file's tensors are assigned
            self.norm = nn.LayerNorm(DIMENSION, eps=MINILM.norm_eps)
            self.layers = nn.ModuleList(_layer() for _ in range(MINILM.layers))
        self.load_state_dict(_state(tensors), strict=False, assign=True)
        self.requires_grad_(False).eval()
        self.tokenizer = _prepare_tokenizer(tokenizer)

    def encode(self, texts: Sequence[str]) -> Float[Tensor, "P 384"]:
        """Unit embeddings (P, 384) float32 of P phrases; P may be 0.

        Deterministic. A phrase gives the same vector alone or in a list, to 1e-5: padding is
        masked in attention and left out of the mean. Case and accents are folded.

        Raises:
            PromptError: a phrase is empty, or holds no word the vocabulary knows.
        """
        tokens = [self.tokens(text) for text in texts]
        embeddings = self.positions.new_zeros(len(tokens), DIMENSION)
        by_length = sorted(range(len(tokens)), key=lambda i: len(tokens[i]))  # little padding per batch
        with torch.no_grad():
            for start in range(0, len(tokens), MINILM.batch):
                chosen = by_length[start : start + MINILM.batch]
                embeddings[chosen] = self(*_pad_tokens([tokens[i] for i in chosen]))
        return embeddings

    def tokens(self, text: str) -> list[int]:
        """Token ids, [CLS] first and [SEP] last, at most 256.

        Raises:
            PromptError: nothing, or nothing known, is between them.
        """
        # Command lines can carry undecodable bytes as lone surrogates, which no tokenizer takes.
        ids = self.tokenizer.encode(text.encode("utf-8", "replace").decode("utf-8")).ids
        if len(ids) <= MINILM.special_tokens:
            raise PromptError("a prompt is empty; describe what to look for in a word or a short phrase")
        unknown = self.tokenizer.token_to_id("[UNK]")
        if all(token == unknown for token in ids[1:-1]):
            raise PromptError(f"the prompt {text!r} holds no word the text model knows; use plain words")
        return ids

    def forward(self, ids: Int[Tensor, "B T"], mask: Shaped[Tensor, "B T"]) -> Float[Tensor, "B C"]:
        """Unit embeddings (B, C) of padded ids (B, T) int64 with mask (B, T), true at real tokens."""
        hidden = self.norm(self.words(ids) + self.positions[: ids.shape[1]])  # (B, T, C)
        padding = None if mask.all() else ~mask
        for layer in self.layers:
            hidden = layer(hidden, src_key_padding_mask=padding)
        kept = mask[..., None].to(hidden.dtype)
        return normalize((hidden * kept).sum(1) / kept.sum(1), dim=-1)


@lru_cache(maxsize=1)
def load_minilm() -> MiniLM:
    """The shipped tower, read once.

    Raises:
        WeightsError: its files are missing or damaged.
    """
    return read_minilm(*shipped_files())


def shipped_files() -> tuple[Path, Path]:
    """Weights and tokenizer of the shipped tower.

    Raises:
        WeightsError: they are missing.
    """
    try:
        weights = asset_path("weights/minilm_l6_v2_rowint8.safetensors")
        return weights, asset_path("weights/minilm_l6_v2_tokenizer.json")
    except FileNotFoundError as error:
        raise WeightsError(str(error)) from error


def read_minilm(weights: Path, vocabulary: Path) -> MiniLM:
    """The tower of a row-int8 safetensors file and a `tokenizers` JSON file.

    Raises:
        WeightsError: a file is unreadable, lacks a tensor, or is not the one that was shipped.
    """
    check_shipped(weights)
    check_shipped(vocabulary)
    try:
        tokenizer = Tokenizer.from_buffer(vocabulary.read_bytes())
        return MiniLM(load_file(weights), tokenizer)
    except (OSError, SafetensorError, KeyError, ValueError, RuntimeError) as error:
        raise WeightsError(
            f"the text model {weights.name} or {vocabulary.name} is damaged ({error}); reinstall LangFlash"
        ) from error


def _layer() -> nn.TransformerEncoderLayer:
    return nn.TransformerEncoderLayer(
        DIMENSION,
        MINILM.heads,
        MINILM.hidden_mlp,
        dropout=0.0,
        activation="gelu",  # the exact one
        layer_norm_eps=MINILM.norm_eps,
        batch_first=True,
        norm_first=False,
    )


def _prepare_tokenizer(tokenizer: Tokenizer) -> Tokenizer:
    """Cut at 256 tokens, and no padding: batches are padded by `_pad_tokens` alone."""
    tokenizer.enable_truncation(MINILM.max_tokens)
    tokenizer.no_padding()
    return tokenizer


def _pad_tokens(tokens: list[list[int]]) -> tuple[Tensor, Tensor]:
    """Ids (B, T) filled with 0 and the mask (B, T) of real tokens."""
    longest = max(len(ids) for ids in tokens)
    ids = torch.tensor([row + [0] * (longest - len(row)) for row in tokens])
    lengths = torch.tensor([len(row) for row in tokens])
    return ids, torch.arange(longest) < lengths[:, None]


def _dense(tensors: dict[str, Tensor], key: str) -> Tensor:
    """A tensor in float32, its int8 rows scaled where it has a `.scale`."""
    scale = tensors.get(key + ".scale")
    dense = tensors[key].to(torch.float32, copy=True)  # not where the file happened to lie
    return dense if scale is None else dense * scale.float()[:, None]


def _state(tensors: dict[str, Tensor]) -> dict[str, Tensor]:
    """BERT's names in the file to the names of torch's transformer layers."""
    state = {f"norm.{end}": _dense(tensors, f"embeddings.LayerNorm.{end}") for end in ("weight", "bias")}
    names = {
        "self_attn.out_proj": "attention.output.dense",
        "norm1": "attention.output.LayerNorm",
        "linear1": "intermediate.dense",
        "linear2": "output.dense",
        "norm2": "output.LayerNorm",
    }
    for index in range(MINILM.layers):
        source, target = f"encoder.layer.{index}.", f"layers.{index}."
        for end in ("weight", "bias"):
            joined = (f"{source}attention.self.{part}.{end}" for part in ("query", "key", "value"))
            state[f"{target}self_attn.in_proj_{end}"] = torch.cat([_dense(tensors, key) for key in joined])
            for ours, theirs in names.items():
                state[f"{target}{ours}.{end}"] = _dense(tensors, f"{source}{theirs}.{end}")
    return state
