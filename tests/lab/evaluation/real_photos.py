"""A folder of drawn "photos" with names, depth and poses, and scenes that know the truth of them."""

from pathlib import Path

import numpy as np
import torch

from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.lab.photos import PhotoFolder, open_folder
from langflash_core.lab.photos.fitting import fitted
from langflash_core.lab.photos.folder import LabelledPhoto
from langflash_core.lab.photos.writing import FolderWriter
from langflash_core.language.spaces import language_space
from langflash_core.network import LangFlashNet
from langflash_core.network.encoders.shared import Tokens
from langflash_core.types import Gaussians, Record, Scene, Semantics

WIDTH, HEIGHT = 112, 84
NAMES = {1: "wall", 2: "floor", 3: "chair", 4: "desk", 5: "lamp", 6: "garbage bin"}
FOCAL = 100.0
_C0 = 0.28209479177387814


def write_folder(root: Path, count: int) -> PhotoFolder:
    """Photos 1 to `count` of a wall two metres away, a little further to the right each time; things are
    painted on it. Photos 4, 11, ... show a lamp, which the others do not."""
    writer = FolderWriter(root)
    for number in range(1, count + 1):
        id = f"{number:03d}"
        labels = _labels(number)
        colours = np.random.default_rng(9).integers(60, 200, (7, 3), dtype=np.uint8)
        writer.photo(id, colours[labels])
        writer.labels(id, labels)
        writer.depths(id, np.full((HEIGHT, WIDTH), 2.0))
        writer.camera(id, FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2)
        pose = torch.eye(4, dtype=torch.float64)
        pose[0, 3] = 0.06 * number
        writer.pose(id, pose)
    writer.finish({id: (name, None) for id, name in NAMES.items()}, "drawn by a test")
    return open_folder(root)


def _labels(number: int) -> np.ndarray:
    """What is painted, seen from 6 cm further right each time: a pixel is 2 cm wide there."""
    wide = np.ones((HEIGHT, WIDTH + 100), dtype=np.int64)
    wide[50:] = 2
    wide[20:70, 50:80] = 3
    wide[35:65, 90:115] = 4
    wide[2:26, 82:102] = 5 if number % 7 == 4 else 1
    wide[:3] = 0
    return wide[:, 3 * number : 3 * number + WIDTH]


def knowing(photos: list[LabelledPhoto], names: dict, *, scale: float = 0.5) -> Scene:
    """The scene that knows the truth of some photos: every pixel in its place, called by its name; lengths
    are `scale` times the true ones. World = the first photo's camera."""
    first = photos[0]
    assert first.pose is not None
    texts = [names[id].text for id in sorted(names)]
    dictionary = language_space("minilm").encode(texts)
    means, colours, atoms, viewmats, Ks = [], [], [], [], []
    size = (56, 42)
    for photo in photos:
        assert photo.pose is not None
        view = fitted(photo, size)
        viewmat = (torch.linalg.inv(photo.pose) @ first.pose).float()
        viewmat[:3, 3] *= scale
        pose = invert_rigid(viewmat)
        pos_c = unproject(torch.full((size[1], size[0]), 2.0 * scale), view.K)
        means.append((pos_c @ pose[:3, :3].T + pose[:3, 3]).reshape(-1, 3))
        colours.append(view.rgb.permute(1, 2, 0).reshape(-1, 3).float() / 255)
        atoms.append((view.labels.reshape(-1) - 1).clamp_min(0))
        viewmats.append(viewmat)
        Ks.append(view.K)
    count = len(photos) * size[0] * size[1]
    width = 0.4 * 2.0 * scale / float(Ks[0][0, 0])
    gaussians = Gaussians(
        means=torch.cat(means),
        quats=torch.tensor([1.0, 0, 0, 0]).repeat(count, 1),
        scales=torch.full((count, 3), width),
        opacities=torch.full((count,), 0.99),
        sh=((torch.cat(colours) - 0.5) / _C0)[:, None],
    )
    semantics = Semantics(torch.cat(atoms)[:, None], torch.ones(count, 1), dictionary, "minilm")
    record = Record(network_unit=1 / scale)
    return Scene(gaussians, semantics, torch.stack(viewmats), torch.stack(Ks), size, record=record)


class KnowingNet(LangFlashNet):
    """Language features that are the names themselves, at half the size of the photo."""

    def __init__(self, folder: PhotoFolder):
        torch.nn.Module.__init__(self)  # no preset: it only knows names
        self.folder = folder
        self.id = folder.ids[0]

    def encode(self, images, Ks):
        return Tokens((), (1, 1))

    def language(self, tokens, images):
        texts = [self.folder.names[id].text for id in sorted(self.folder.names)]
        labels = torch.from_numpy(self.folder.labels(self.id)[::4, ::4].copy())
        return language_space("minilm").encode(texts)[(labels - 1).clamp_min(0)].permute(2, 0, 1)[None, None]
