"""How the groups of a scene look in its photos: one vector each, to compare those of several scenes by.

    a_k = normalise( sum_p m_k(p) (h(p) - mean h) / sum_p m_k(p) ),

with h the encoder's last layer, of the half that learned from real photos, over a photo's patches p, and
m_k(p) how much of atom k the patch shows. What all of a photo has in common, light and lens, goes with the
mean. Across real rooms these vectors say what is alike far better than the dictionary does, whose rows of one
word lie together however different the things are (MEASURED.md, "What is taught in one room").

Sizes: V photos, K atoms, C channels of the encoder.
"""

import hashlib
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.picture_files import decoded_photo
from langflash_core.errors import InputError, PromptError
from langflash_core.language.lessons import Lesson, Lessons, fitting
from langflash_core.network import LangFlashNet, load_network
from langflash_core.network.encoders.shared import tokens_to_maps
from langflash_core.scene.atoms import atom_cells
from langflash_core.types import NO_LANGUAGE, Scene

PRESET = "mini"
MOST_PHOTOS = 8  # evenly among them; memory, and more say the same again
LEAST = 2.0  # cells of a photo that an atom has to fill, before it looks like anything


@dataclass(frozen=True)
class Appearances:
    """rows: (K, C), unit; 0 of atoms that no photo shows. network: which one looked, a digest: vectors of
    two networks have nothing to do with each other."""

    rows: Float[np.ndarray, "K C"]
    network: str


@torch.inference_mode()
def appearances(scene: Scene, network: LangFlashNet | None = None) -> Appearances:
    """Look at a scene's own photos again.

    Args:
        network: of the preset mini; None: the shipped one.

    Raises:
        PromptError: the scene has no language. InputError: it holds no photo, or none that opens.
        WeightsError: of the shipped network.
    """
    if scene.semantics.space == NO_LANGUAGE:
        raise PromptError("the scene has no language; give it one with `langflash lift`")
    chosen = scene.some_views(MOST_PHOTOS) if scene.photos else []
    photos = {view: photo for view in chosen if (photo := decoded_photo(scene.photos[view])) is not None}
    if not photos:
        raise InputError("the scene holds no photos to recognise its groups by; use one made of photos")
    network = network or own_network()
    sums: Tensor | None = None
    for view, photo in photos.items():
        maps = _looked_at(network, scene, view, photo)  # (C, h, w)
        cells = torch.from_numpy(atom_cells(scene, view)).to(maps)[None]  # (1, K, h', w')
        shares = F.interpolate(cells, maps.shape[1:], mode="area")[0]  # (K, h, w)
        area = cells.sum((0, 2, 3)) >= LEAST
        own = torch.einsum(
            "khw,chw->kc", shares * area[:, None, None], maps - maps.mean((1, 2), keepdim=True)
        )
        sums = own if sums is None else sums + own
    assert sums is not None
    return Appearances(F.normalize(sums, dim=-1, eps=1e-9).numpy(), _digest(network))


def own_network() -> LangFlashNet:
    """The shipped one, for `appearances` of several scenes."""
    return load_network(PRESET)


def lessons_taken(scene: Scene, lessons: Lessons, network: LangFlashNet | None = None) -> dict[int, Lesson]:
    """What the groups of a scene take of a vocabulary, by atom; what was taught in it goes before.

    Raises:
        PromptError: of another network, or the scene has no language. InputError: it holds no photo.
    """
    record, looks = scene.record, appearances(scene, network)
    return fitting(looks.rows, looks.network, lessons, {*record.atom_names, *record.atom_denials})


def _looked_at(network: LangFlashNet, scene: Scene, view: int, photo: np.ndarray) -> Float[Tensor, "C h w"]:
    """The encoder's last taught layer over one photo, float64."""
    width, height = scene.view_size
    image = torch.from_numpy(photo.copy()).permute(2, 0, 1)[None].float() / 255
    if image.shape[-2:] != (height, width):
        image = F.interpolate(image, (height, width), mode="bilinear", antialias=True)
    tokens = network.encode(image[None], scene.Ks[view][None, None].float())
    if not tokens.named:
        raise InputError("this network has no layer that real photos taught; use the preset mini")
    return tokens_to_maps(tokens.named[-1].flatten(0, 1), tokens.grid)[0].double()


def _digest(network: LangFlashNet) -> str:
    """Of the encoder's weights, both halves."""
    found = hashlib.sha256()
    for name, value in sorted(network.state_dict().items()):
        if name.startswith(("encoder.", "late.")):
            found.update(name.encode())
            found.update(value.contiguous().cpu().view(torch.uint8).numpy().tobytes())
    return found.hexdigest()[:16]
