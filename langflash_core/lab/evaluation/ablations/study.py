"""One room, named in a new view by every rival: the same Gaussians, camera and rasteriser for all of them.

Sizes: V views, H W pixels, N = V H W Gaussians, K groups, C channels, G class groups, d channels splatted.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.running import Progress
from langflash_core.geometry.cameras import invert_rigid, transform, unproject
from langflash_core.lab.evaluation.ablations.groupings import point_groups, regrouped, true_names
from langflash_core.lab.evaluation.drawing import drawn_features, placed_gaussians
from langflash_core.lab.evaluation.rooms.run import named_records, open_rooms, true_scale
from langflash_core.lab.evaluation.rooms.tally import Setting
from langflash_core.lab.evaluation.rooms.target import (
    class_rows,
    label_tables,
    language_maps,
    target_camera,
    upsampled,
)
from langflash_core.lab.evaluation.rooms.truth import opened, records, seen_by_photos, true_masks, views_of
from langflash_core.lab.evaluation.tallies import MEASURES, Noted, Shelf, identity
from langflash_core.lab.training.shards import RoomRecord
from langflash_core.language.channels import Decoder, principal
from langflash_core.network.model import Seen, pooled_weights
from langflash_core.network.semantics.aggregation import averaged_atoms
from langflash_core.scene.weights import renormalise
from langflash_core.types import Prediction

KEPT = 8
"""Weights of a Gaussian, as scenes hold them."""
GROUPS = (16, 32, 64, 96, 128, 196, 256)
"""K of the study; the paper's, and two below what the network finds by itself."""
CHANNELS = (3, 16, 64)
"""Of low-dimensional features."""
RESIDUAL = 8
SHARE = 0.5
"""Of the residual that is added to the atoms' answer."""
FITTED_ON, PIXELS = 64, 400
"""Training rooms that bases and decoders are fitted on, and pixels of each."""
FITS = "fits.safetensors"
"""Keeps what they are fitted on, beside the tallies."""
BYTES = {
    "atoms": 3 * KEPT,
    "splatted": 2 * 384,
    **{f"low_{d}": 2 * d for d in CHANNELS},
    "residual": 3 * KEPT + 2 * RESIDUAL,
}
"""Of language in a Gaussian: a byte for an id and two for a weight, two for a channel. What a scene holds
once is left out: K atoms, or a decoder."""


@dataclass
class Tally(Noted):
    """counts: confusion by (row, list of labels) in the new view."""

    counts: dict[tuple[str, str], Tensor] = field(default_factory=dict)


@dataclass(frozen=True)
class Examples:
    """Of training rooms: features (n, C) of pixels, and what atoms of theirs leave of them (n, C)."""

    features: Tensor
    left: Tensor


def gathered(rooms: Iterator[tuple[Tensor, Tensor]]) -> Examples:
    """Of pairs of features and what is left of them, (X, C) each, `PIXELS` evenly of each room."""
    features, left = [], []
    for own, rest in rooms:
        places = torch.linspace(0, len(own) - 1, min(PIXELS, len(own))).long()
        features.append(own[places])
        left.append(rest[places])
    return Examples(torch.cat(features), torch.cat(left))


@dataclass(frozen=True)
class Fits:
    """decoders by channels; residual: directions (8, C) of what atoms leave."""

    decoders: dict[int, Decoder]
    residual: Tensor


def opened_study(
    data: Path,
    weights: Path | None = None,
    *,
    limit: int | None = None,
    most: int | None = None,
    shelf: Shelf | None = None,
    progress: Progress = lambda stage, fraction: None,
) -> tuple[Setting, Fits, int, Iterator[tuple[str, RoomRecord]]]:
    """The setting, what is fitted, how many rooms there are, and seed and record of each, in order.

    Args:
        data: cache folder; `held_out` is judged, decoders are fitted on `train`. most: of the rooms,
            taken evenly (None: all). shelf: keeps what is fitted on for the next run.

    Raises:
        InputError: there is no such cache. WeightsError: the weights do not fit.
    """
    setting, rooms = open_rooms(data, weights, limit=limit)
    source = f"{MEASURES}, {identity(weights, 'mini')}, {data.resolve()}"
    fits = _fits(setting, data, None if shelf is None else shelf.folder / FITS, source, progress)
    every = 1 if most is None else max(1, -(-len(rooms) // most))
    return setting, fits, -(-len(rooms) // every), islice(named_records(rooms), 0, None, every)


def grouped_shelf(shelf: Shelf, setting: Setting) -> Shelf:
    """For tallies: rows of a confusion table are the groups of the rooms at hand."""
    return replace(shelf, key={**shelf.key, "groups": setting.groups})


def _fits(setting: Setting, data: Path, kept: Path | None, source: str, progress: Progress) -> Fits:
    examples = None if kept is None else kept_examples(kept, source)
    if examples is None:
        examples = gathered(_train_features(setting, data, progress))
        if kept is not None:
            keep_examples(kept, source, examples)
    decoders = {count: Decoder.fit(examples.features, count) for count in CHANNELS}
    return Fits(decoders, principal(examples.left, RESIDUAL))


def keep_examples(path: Path, source: str, examples: Examples) -> None:
    """Write them, with what they come from.

    Raises:
        OutputError: they cannot be written.
    """
    make_folder(path.parent)
    content = {"features": examples.features.contiguous(), "left": examples.left.contiguous()}
    write_atomically(path, save(content, {"source": source}))


def kept_examples(path: Path, source: str) -> Examples | None:
    """What was kept before; None where there is nothing, or what is there is of another source."""
    try:
        with safe_open(path, "pt") as stored:
            if (stored.metadata() or {}).get("source") != source:
                return None
            return Examples(stored.get_tensor("features"), stored.get_tensor("left"))
    except (OSError, SafetensorError):
        return None


@torch.no_grad()
def _train_features(setting: Setting, data: Path, progress: Progress) -> Iterator[tuple[Tensor, Tensor]]:
    """L(x) of the pixels of training rooms, and what averaged atoms leave of it."""
    network = setting.network
    rooms = opened(data / "train", FITTED_ON)
    for done, record in enumerate(records(rooms)):
        progress(f"training room {done + 1} of {len(rooms)}", done / len(rooms))
        views = views_of(record, (0, 1))
        features, tokens = language_maps(network, views)
        size = (features.shape[-2], features.shape[-1])
        weights = network.parts(tokens, views.images[None], size, features)
        atoms = averaged_atoms(weights[None], features)[0]
        left = features[0] - torch.einsum("vkhw,kc->vchw", weights, atoms)
        yield tuple(m.permute(0, 2, 3, 1).flatten(0, 2) for m in (features[0], left))  # type: ignore[misc]


@dataclass(frozen=True)
class _Room:
    """What all rivals of one room share. features: (1, V, C, h, w); pixels: the same at every Gaussian
    (N, C); truth: rows of the new view (H W,), -1 where no photo sees it."""

    setting: Setting
    record: RoomRecord
    prediction: Prediction
    features: Tensor
    pixels: Tensor
    seen: Seen
    truth: Tensor
    scale: float
    tally: Tally

    def draw(self, values: Tensor) -> tuple[Tensor, float]:
        """Maps (H, W, F) of values (N, F), and the milliseconds they took."""
        camera, gaussians = target_camera(self.record, self.scale), placed_gaussians(self.prediction)
        start = time.perf_counter()
        return drawn_features(gaussians, values, camera), 1e3 * (time.perf_counter() - start)

    def count(self, row: str, vectors: Tensor) -> None:
        """Language vectors (H, W, C) of the new view against the truth."""
        found = (vectors @ self.setting.texts.T).argmax(-1).flatten()
        for kind, table in label_tables(self.setting, found, self.truth).items():
            self.tally.counts[row, kind] = table


@torch.no_grad()
def judge(setting: Setting, fits: Fits, record: RoomRecord) -> Tally:
    """Every rival on one room of at least three views."""
    tally = Tally()
    views = views_of(record, (0, 1))
    prediction = setting.network.predict(views)
    tally.note(**{f"stage_{name}_seconds": value for name, value in prediction.timings.items()})
    features, tokens = language_maps(setting.network, views)
    height, width = record.rgb.shape[-2:]
    pixels = torch.cat([upsampled(view, (height, width)).flatten(0, 1) for view in features[0]])
    truth = torch.from_numpy(class_rows(setting, record, 2)).masked_fill(~seen_by_photos(record), -1)
    room = _Room(
        setting,
        record,
        prediction,
        features,
        pixels,
        Seen(views.images, tokens, prediction.depths, prediction.viewmats, views.Ks),
        truth.flatten(),
        true_scale(prediction.depths[0], record.depths[0].float()),
        tally,
    )
    _judge_groupings(room)
    _judge_features(room, fits)
    _judge_groups(room)
    return tally


def stored(weights: Tensor) -> Tensor:
    """w (V, K, H, W) as scenes hold it: the largest `KEPT` of a Gaussian, sum 1, (N, K)."""
    rows = weights.permute(0, 2, 3, 1).flatten(0, 2)
    values, places = rows.topk(min(KEPT, rows.shape[1]), dim=-1)
    return torch.zeros_like(rows).scatter(1, places, renormalise(values))


def _vectors(room: _Room, weights: Tensor) -> tuple[dict[str, Tensor], float]:
    """Atoms (K, C) by averaging and by the network's aggregation and naming, and the latter's seconds."""
    average = averaged_atoms(pooled_weights(weights, room.features), room.features)[0]
    start = time.perf_counter()
    lfa = room.setting.network.dictionary(weights, room.features, room.seen)
    return {"average": average, "lfa": lfa}, time.perf_counter() - start


def _judge_groupings(room: _Room) -> None:
    """Points, the network's groups and true masks, each with true names, averages and aggregation."""
    record, setting = room.record, room.setting
    points = transform(
        invert_rigid(room.prediction.viewmats)[:, None],
        unproject(room.prediction.depths, room.seen.Ks),
    )
    colours = record.rgb[:2].permute(0, 2, 3, 1).float() / 255
    start = time.perf_counter()
    by_points = point_groups(points, colours, room.prediction.weights.shape[1])
    room.tally.note(points_seconds=time.perf_counter() - start)
    classes = torch.stack([torch.from_numpy(class_rows(setting, record, view)) for view in (0, 1)])
    groupings = {"points": by_points, "sg": room.prediction.weights, "true": true_masks(record, (0, 1))}
    for grouping, weights in groupings.items():
        maps, milliseconds = room.draw(stored(weights))
        vectors, seconds = _vectors(room, weights)
        vectors["names"] = setting.texts[true_names(weights, classes, len(setting.groups))]
        for kind, atoms in vectors.items():
            room.count(f"{grouping}/{kind}", maps @ atoms)
        prefix = "atoms" if grouping == "sg" else grouping
        room.tally.note(
            **{
                f"{prefix}_ms": milliseconds,
                f"{prefix}_count": weights.shape[1],
                f"{prefix}_lfa_seconds": seconds,
            }
        )


def _judge_features(room: _Room, fits: Fits) -> None:
    """Language as numbers of pixels: of the new view's own photo, splatted, compressed, beside atoms."""
    size = (room.record.rgb.shape[-2], room.record.rgb.shape[-1])
    start = time.perf_counter()
    alone = language_maps(room.setting.network, views_of(room.record, (2,)))[0][0, 0]
    room.tally.note(features_ms=1e3 * (time.perf_counter() - start))
    room.count("features", upsampled(alone, size))
    whole, milliseconds = room.draw(room.pixels)
    room.tally.note(splatted_ms=milliseconds)
    room.count("splatted", whole)
    for channels, decoder in fits.decoders.items():
        coded, milliseconds = room.draw(room.pixels @ decoder.basis.T)
        start = time.perf_counter()
        decoded = decoder(coded)
        spent = 1e3 * (time.perf_counter() - start)
        room.tally.note(**{f"low_{channels}_ms": milliseconds + spent, f"low_{channels}_decoding_ms": spent})
        room.count(f"low_{channels}", decoded)
    _judge_residual(room, fits.residual)


def _judge_residual(room: _Room, directions: Tensor) -> None:
    weights = stored(room.prediction.weights)
    vectors, _ = _vectors(room, room.prediction.weights)
    left = (room.pixels - weights @ vectors["average"]) @ directions.T
    maps, milliseconds = room.draw(torch.cat((weights, left), 1))
    room.tally.note(residual_ms=milliseconds)
    atoms, rest = maps[..., : weights.shape[1]], maps[..., weights.shape[1] :] @ directions
    room.count("residual", atoms @ vectors["lfa"] + SHARE * rest)


def _judge_groups(room: _Room) -> None:
    """The network's groups, merged or cut to other numbers of them."""
    for count in GROUPS:
        weights = regrouped(room.prediction.weights, room.features, count)
        maps, milliseconds = room.draw(stored(weights))
        vectors, seconds = _vectors(room, weights)
        for kind, atoms in vectors.items():
            room.count(f"K{count}/{kind}", maps @ atoms)
        room.tally.note(
            **{
                f"K{count}_ms": milliseconds,
                f"K{count}_count": weights.shape[1],
                f"K{count}_lfa_seconds": seconds,
            }
        )
