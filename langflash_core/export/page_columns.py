"""A scene's Gaussians, and tables over its atoms, as columns of small integers: what a web page holds, and
`page/decode.js` and `page/layers.js` read.

Of a scene of layers the Gaussians come layer by layer, then those that no photo made. Where a layer's lie in
the picture of its own photo, they are stored there: on the photo's grid, where they were made, what differs
from one to the next is short, and a page is a quarter smaller. Red and blue are stored as what they
differ from green.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Integer
from torch import Tensor

from langflash_core.export.quantised import quantise
from langflash_core.export.settings import COLUMNS
from langflash_core.rig.projected import project_points
from langflash_core.types import Scene


@dataclass(frozen=True)
class Column:
    """Integers under a name: `width` bytes each, as they are or as differences."""

    name: str
    values: np.ndarray
    width: int = 1
    differences: bool = False

    def packed(self) -> bytes:
        """As the page's program reads it."""
        top = 1 << 8 * self.width
        values = self.values.astype(np.int64).ravel()
        if self.differences:
            values = np.diff(values, prepend=0) % top
            if self.width == 2:  # 1, -1, 2, -2, ... are 2, 1, 4, 3, ...
                values = np.where(values < top // 2, 2 * values, 2 * (top - values) - 1)
        return b"".join((values >> 8 * byte & 255).astype(np.uint8).tobytes() for byte in range(self.width))


def gaussian_columns(scene: Scene, origin: Tensor) -> tuple[dict, list[Column]]:
    """What of the header the Gaussians need, and their columns."""
    around = scene.gaussians.means.double().cpu() - origin.cpu()
    stored = quantise(scene.gaussians.map(lambda values: values.cpu()), around)
    columns = [Column("largest", stored.largest), Column("opacity", stored.opacities, differences=True)]
    for axis in range(3):
        columns += [
            Column(f"mean{axis}", stored.steps[:, axis], 2, True),
            Column(f"turn{axis}", stored.turns[:, axis], differences=True),
            Column(f"scale{axis}", stored.scales[:, axis], differences=True),
            Column(f"colour{axis}", stored.colours[:, axis], differences=True),
        ]
    header = {
        "lowest": stored.lowest.tolist(),
        "highest": stored.highest.tolist(),
        "scaleBook": stored.scale_book.tolist(),
        "colourBook": stored.colour_book.tolist(),
    }
    if stored.harmonics is not None:
        palette = stored.harmonics
        header |= {"harmonicsBook": palette.book.tolist(), "bases": palette.places.shape[1]}
        columns += [Column("palette", palette.places), Column("label", palette.labels, 2)]
    return header, columns


def weight_columns(scene: Scene) -> list[Column]:
    """The largest weights of each Gaussian, of 255 in sum."""
    semantics = scene.semantics
    values, places = semantics.weight_values.cpu().topk(
        min(COLUMNS.most_weights, semantics.weight_ids.shape[1]), 1
    )
    ids = semantics.weight_ids.cpu().gather(1, places).numpy()
    shares = torch.nan_to_num(values / values.sum(1, keepdim=True).clamp_min(1e-9)).double().numpy()
    steps = np.round(255 * shares).astype(int)
    ids = np.where(steps > 0, ids, 0)
    width = 1 if semantics.num_atoms <= 256 else 2
    columns = []
    for place in range(steps.shape[1]):
        columns += [Column(f"atom{place}", ids[:, place], width), Column(f"weight{place}", steps[:, place])]
    return columns


def table_column(name: str, numbers: Tensor, header: dict) -> Column:
    """Signed numbers in 16 bits of the largest, which the header takes."""
    values = numbers.detach().double().cpu().numpy()
    largest = max(float(np.abs(values).max(initial=0)), 1e-9)
    header["phrases"][f"{name}Unit"] = largest / 32767
    return Column(name, np.round(values / largest * 32767).astype(int) % 65536, 2)


def in_layers(scene: Scene) -> Scene:
    """A scene of layers with its Gaussians layer by layer, those that no photo made last."""
    assert scene.view_ids is not None
    ids = scene.view_ids.cpu()
    return scene.rows(torch.where(ids < 0, scene.num_views, ids).argsort(stable=True))


def layered_columns(scene: Scene, origin: Tensor) -> tuple[dict, list[Column]]:
    """As `gaussian_columns`, of a scene `in_layers`.

    Returns:
        The header also has "layers": the photo and the number of Gaussians of each, and the lowest place of
        those that are stored as `place` columns; "mean" columns hold the others.
    """
    assert scene.view_ids is not None
    header, columns = gaussian_columns(scene, origin)
    ids = scene.view_ids.cpu()
    layers, places, plain = [], [], [ids < 0]
    for view in range(scene.num_views):
        own = ids == view
        count = int(own.sum())
        found = _places(scene, view, own) if count else None
        layers += [{"view": view, "count": count}] if count else []
        if found is None:
            plain.append(own)
        else:
            layers[-1]["lowest"] = found[0].tolist()
            places.append(found[1])
    rows = torch.stack(plain).any(0).numpy()
    by_name = {column.name: column for column in columns}
    green = by_name["colour1"].values
    for axis in range(3):
        mean = by_name[f"mean{axis}"]
        by_name[mean.name] = replace(mean, values=mean.values[rows])
    for axis in (0, 2):
        colour = by_name[f"colour{axis}"]
        by_name[colour.name] = replace(colour, values=(colour.values - green) % 256)
    steps = np.concatenate(places) if places else np.zeros((0, 3), int)
    placed = [Column(f"place{axis}", steps[:, axis], 2, True) for axis in range(3)]
    return {**header, "layers": layers}, [*placed, *by_name.values()]


def _places(
    scene: Scene, view: int, rows: Bool[Tensor, " N"]
) -> tuple[Integer[np.ndarray, " 3"], Integer[np.ndarray, "n 3"]] | None:
    """Pixel x, y and the logarithm of depth in a photo of some Gaussians, in `COLUMNS.place_steps`: the
    lowest of each, and what is above it, in 16 bits; None where one has no place there."""
    points = scene.gaussians.means[rows.to(scene.gaussians.means.device)].double().cpu()
    camera = scene.viewmats[view].double().cpu(), scene.Ks[view].double().cpu()
    width, height = scene.view_size
    there = project_points(points.T, *camera, (height, width))
    if not bool((there.z > COLUMNS.nearest).all()):
        return None
    steps = np.round(torch.stack((there.x, there.y, there.z.log()), 1).numpy() * COLUMNS.place_steps)
    lowest = steps.min(0)
    above = steps - lowest
    return (lowest.astype(int), above.astype(int)) if above.max() < 1 << 16 else None
