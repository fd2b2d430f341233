"""CLIP ViT-B/32's text tower, the space of LSeg and of the `full` preset. C = 512.

The architecture and tokenizer are open_clip's, imported only here and only when asked for.
The weights are not shipped. They are searched, in this order:

1. the `source` argument,
2. the environment variable LANGFLASH_CLIP,
   both a file (open_clip or plain state dict, .safetensors or .pt; image weights are ignored)
   or a tag that open_clip downloads ("openai"),
3. `weights/clip_vitb32.safetensors` (or .pt) in the cache folder (`resources.home_folder`).

LSeg was trained with OpenAI's weights and plain phrases: "openai", and no prompt template.
"""

import importlib
import os
import pickle
import shutil
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import torch
from jaxtyping import Float
from safetensors import SafetensorError
from torch import Tensor
from torch.nn.functional import normalize

from langflash_core.base.files import written_atomically
from langflash_core.base.optional import optional_packages
from langflash_core.base.resources import weights_folder
from langflash_core.base.torchvision_fix import ensure_torchvision
from langflash_core.errors import PromptError, WeightsError

DIMENSION = 512
ARCHITECTURE = "ViT-B-32-quickgelu"  # OpenAI's weights were trained with the approximate GELU
_FILES = ("clip_vitb32.safetensors", "clip_vitb32.pt")
_MEAN, _STD = (0.48145466, 0.4578275, 0.40821073), (0.26862954, 0.26130258, 0.27577711)
# A small image tower costs nothing to build; it is thrown away at once.
_TINY_VISION = {"image_size": 32, "patch_size": 32, "width": 64, "layers": 1}
_REMEDY = (
    "put OpenAI's ViT-B/32 at {place}, or set LANGFLASH_CLIP to such a file or to the open_clip tag 'openai'"
)


class ClipImages:
    """open_clip's ViT-B/32 image tower: whole pictures to the space of `ClipText`."""

    def __init__(self, model: Any) -> None:
        self.model = model.requires_grad_(False).eval()

    def encode(self, pictures: Float[Tensor, "n 3 224 224"]) -> Float[Tensor, "n 512"]:
        """Unit embeddings (n, 512) float32 of pictures (n, 3, 224, 224) in [0, 1]."""
        if len(pictures) == 0:
            return torch.zeros(0, DIMENSION)
        mean, std = (torch.tensor(values)[:, None, None].to(pictures) for values in (_MEAN, _STD))
        with torch.no_grad():
            return normalize(self.model.encode_image((pictures - mean) / std).float(), dim=-1)


class ClipText:
    """open_clip's ViT-B/32 text tower behind the same `encode` as MiniLM."""

    def __init__(self, model: Any, tokenizer: Callable[[list[str]], Tensor]) -> None:
        self.model = model.requires_grad_(False).eval()
        self.tokenizer = tokenizer

    def encode(self, texts: Sequence[str]) -> Float[Tensor, "P 512"]:
        """Unit embeddings (P, 512) float32; phrases are cut at 77 tokens.

        Raises:
            PromptError: a phrase is empty.
        """
        if any(not text.strip() for text in texts):
            raise PromptError("a prompt is empty; describe what to look for in a word or a short phrase")
        if not texts:
            return torch.zeros(0, DIMENSION)
        tokens = self.tokenizer([text.encode("utf-8", "replace").decode("utf-8") for text in texts])
        with torch.no_grad():
            return normalize(self.model.encode_text(tokens).float(), dim=-1)


def build_clip() -> ClipText:
    """The tower as open_clip initialises it (random), without its image half."""
    open_clip = _open_clip()
    config = open_clip.get_model_config(ARCHITECTURE)
    model = open_clip.CLIP(**{**config, "vision_cfg": _TINY_VISION})
    del model.visual
    return ClipText(model, open_clip.get_tokenizer(ARCHITECTURE))


@lru_cache(maxsize=1)
def load_clip(source: str | None = None) -> ClipText:
    """The tower with its weights, read once per `source` (module docstring).

    Raises:
        WeightsError: no weights are there, or they do not fit; says where to put them.
    """
    path = _locate(source or os.environ.get("LANGFLASH_CLIP"))
    tower = build_clip()
    state = {name: tensor for name, tensor in _read_state(path).items() if not name.startswith("visual.")}
    try:
        tower.model.load_state_dict(state)
    except (RuntimeError, AttributeError) as error:
        reason = " ".join(str(error).split())[:200]
        raise WeightsError(f"{path} does not hold CLIP ViT-B/32 ({reason}); {_remedy()}") from error
    return tower


@lru_cache(maxsize=1)
def load_clip_images(source: str | None = None) -> ClipImages:
    """The image tower with its weights, found as `load_clip` finds them.

    Raises:
        WeightsError: no weights are there, or they lack the image half.
    """
    path = _locate(source or os.environ.get("LANGFLASH_CLIP"))
    open_clip = _open_clip()
    model = open_clip.CLIP(**open_clip.get_model_config(ARCHITECTURE))
    try:
        model.load_state_dict(_read_state(path))
    except (RuntimeError, AttributeError) as error:
        reason = " ".join(str(error).split())[:200]
        raise WeightsError(f"{path} does not hold all of CLIP ViT-B/32 ({reason}); {_remedy()}") from error
    return ClipImages(model)


def fetch_clip(tag: str = "openai") -> Path:
    """Put CLIP's weights where `load_clip` looks, downloaded by open_clip; the file.

    Raises:
        WeightsError: they cannot be had.
    """
    source = _locate(tag)
    target = weights_folder() / (_FILES[0] if source.suffix == ".safetensors" else _FILES[1])
    with written_atomically(target) as temporary:
        shutil.copyfile(source, temporary)
    return target


def _open_clip() -> Any:
    """The package.

    Raises:
        MissingPackageError: it is not installed.
    """
    with optional_packages():
        ensure_torchvision()
        return importlib.import_module("open_clip")


def _remedy() -> str:
    return _REMEDY.format(place=weights_folder() / _FILES[0])


def _locate(source: str | None) -> Path:
    """The file that `source` names, downloaded where it is an open_clip tag."""
    if source is None:
        found = [weights_folder() / name for name in _FILES if (weights_folder() / name).is_file()]
        if not found:
            raise WeightsError(f"the 'clip' language space needs CLIP's text weights; {_remedy()}")
        return found[0]
    if Path(source).is_file():
        return Path(source)
    open_clip = _open_clip()
    config = open_clip.get_pretrained_cfg(ARCHITECTURE, source)
    if not config:
        raise WeightsError(f"CLIP weights '{source}' are neither a file nor a tag of open_clip; {_remedy()}")
    try:
        return Path(open_clip.download_pretrained(config))
    except (OSError, RuntimeError, ValueError) as error:  # no network, no such file on the hub
        raise WeightsError(f"CLIP weights '{source}' could not be downloaded; {_remedy()}") from error


def _read_state(path: Path) -> dict[str, Tensor]:
    """A state dict, never running code from the file."""
    open_clip = _open_clip()
    try:
        return open_clip.factory.load_state_dict(str(path), device="cpu", weights_only=True)
    except (OSError, RuntimeError, ValueError, SafetensorError, pickle.UnpicklingError, EOFError) as error:
        raise WeightsError(f"{path} is damaged or is no plain state dict; {_remedy()}") from error
