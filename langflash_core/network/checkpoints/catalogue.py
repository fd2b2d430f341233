"""Where published checkpoints can be had. Their licences are their authors', not this project's."""

from dataclasses import dataclass

from langflash_core.errors import InputError

_NOPOSPLAT = "https://huggingface.co/botaoye/NoPoSplat/resolve/main"
_LICENCE = "MIT code on CC BY-NC-SA 4.0 parts and weights: not for commercial use"


@dataclass(frozen=True)
class Published:
    """name: what `langflash weights get` calls it. preset: whose part it becomes. file: its own name.
    size: photos it was trained on, pixels a side (0: any)."""

    name: str
    preset: str
    part: str
    url: str
    about: str
    licence: str
    size: int = 0

    @property
    def file(self) -> str:
        return self.url.rpartition("/")[2]


CATALOGUE = (
    Published(
        "noposplat-mix", "full", "geometry", f"{_NOPOSPLAT}/mixRe10kDl3dv.ckpt",
        "NoPoSplat, RealEstate10K and DL3DV, 2 views (the best start)", _LICENCE, 256,
    ),
    Published(
        "noposplat-mix-512", "full", "geometry", f"{_NOPOSPLAT}/mixRe10kDl3dv_512x512.ckpt",
        "NoPoSplat, the same at 512 x 512", _LICENCE, 512,
    ),
    Published(
        "noposplat-re10k", "full", "geometry", f"{_NOPOSPLAT}/re10k.ckpt",
        "NoPoSplat, RealEstate10K, 2 views", _LICENCE, 256,
    ),
    Published(
        "noposplat-re10k-3views", "full", "geometry", f"{_NOPOSPLAT}/re10k_3views.ckpt",
        "NoPoSplat, RealEstate10K, 3 views", _LICENCE, 256,
    ),
    Published(
        "noposplat-acid", "full", "geometry", f"{_NOPOSPLAT}/acid.ckpt",
        "NoPoSplat, landscapes from the air, 2 views", _LICENCE, 256,
    ),
    Published(
        "langflash", "full", "grouping", "https://huggingface.co/li2231/LangFlash/resolve/main/re10k.ckpt",
        "LangFlash's released grouping, RealEstate10K", "none is stated", 256,
    ),
    Published(
        "lseg", "full", "language",
        "https://huggingface.co/joonyeol99/LSeg_ViT-to-ONNX/resolve/main/demo_e200.ckpt",
        "LSeg demo_e200 with CLIP ViT-B/32 (a third party's copy of the authors' file)", "MIT",
    ),
)  # fmt: skip
CLIP = Published(
    "clip", "full", "text", "open_clip:openai", "CLIP ViT-B/32, text and pictures, through open_clip", "MIT"
)
"""Not a part of the network; LSeg's checkpoint brings it along."""
SAM2 = Published(
    "sam2", "full", "masks",
    "https://dl.fbaipublicfiles.com/segment_anything_2/092824/sam2.1_hiera_large.pt",
    "SAM 2.1, masks for groups where no grouping is installed; needs its package too", "Apache-2.0",
)  # fmt: skip
"""Not a part of the network, and kept as it is: SAM 2's own package reads it."""
OTHERS = (CLIP, SAM2)


def trained_side(file: str) -> int:
    """Pixels a side of the photos that the published checkpoint of this name was trained on; 0: unknown."""
    return next((entry.size for entry in CATALOGUE if file.endswith(entry.file)), 0)


def find_published(name: str) -> Published:
    """The entry called `name`.

    Raises:
        InputError: there is none.
    """
    for entry in (*CATALOGUE, *OTHERS):
        if entry.name == name:
            return entry
    names = ", ".join(entry.name for entry in (*CATALOGUE, *OTHERS))
    raise InputError(f"there is no published checkpoint '{name}' here; choose one of {names}")
