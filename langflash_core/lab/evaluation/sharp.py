"""`langflash lab eval sharp`: how near a scene's picture is to its photo at the photo's size.

A scene is drawn from each of its photos' own places at the photo's size, at most three times the network's
grid, and from where kept photos were taken. Two rivals stand beside it in the same run: "grid", the photo
brought to the network's grid and back, and "plain", the scene as the network makes it, one Gaussian a pixel.

A *column* is what is judged: "grid", a way to make scenes ("plain", "low", "normal", "high"), or "other",
scenes of another version of the code. A *group* is where it is judged: "photos" (their own places), "between"
and "between_small" (a kept photo, at its size and at the network's), "once" (what a scene has once).

Sizes: H W pixels.
"""

import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch
from torch import Tensor

from langflash_core.base.detail import DEFAULT_DETAIL
from langflash_core.base.files import make_folder
from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.lab.evaluation import bench as benches
from langflash_core.lab.evaluation.bench import Render, as_seen, picture_of, wordless
from langflash_core.lab.evaluation.lpips import Lpips
from langflash_core.lab.evaluation.sharp_measures import (
    check_pictures,
    crop_camera,
    detail,
    flat_windows,
    lattice,
    let_through,
    on_grid,
    opaque,
    ripple,
    spread_windows,
    true_detail,
    window_side,
)
from langflash_core.lab.evaluation.sharp_subjects import Subject, size_of
from langflash_core.lab.evaluation.side_measures import Similarity, seen_by
from langflash_core.lab.evaluation.side_subjects import Look, photo_look
from langflash_core.lab.evaluation.sides import aligned, camera_of, covered_depths
from langflash_core.lab.evaluation.sights import Look as Shown
from langflash_core.lab.evaluation.sights import Sight, closeups
from langflash_core.lab.evaluation.tables import (
    Measure,
    Pairs,
    Table,
    by_measure,
    number,
    rounded,
    told_difference,
)
from langflash_core.lab.evaluation.tallies import Rows, judged
from langflash_core.lab.training.measures import nan_mean, psnr
from langflash_core.scene.file import load, save
from langflash_core.types import Camera, Scene

PLAIN = "plain"
WAYS = (PLAIN, DEFAULT_DETAIL)
"""How scenes are made where nobody says it: one Gaussian a pixel, and in a detail; the last one is set
against all other columns."""
GRID, OTHER = "grid", "other"
ENLARGED = 8
"""Times the photo's size, at which surfaces must still let nothing through."""
FLATTEST = 4
"""So many flat windows of a photo are enlarged."""


_PICTURE = (
    Measure("PSNR (dB)", "psnr", ".2f"),
    Measure("LPIPS", "lpips"),
    Measure("detail, of the photo's", "detail"),
    Measure("detail in its place, of the photo's", "true_detail"),
    Measure("lattice on flat walls (1/255)", "lattice", ".2f"),
    Measure("opaque (% of pixels)", "opaque", ".1%"),
    Measure("light from behind (%)", "through", ".1%"),
    Measure("opaque at eight times that size (%)", "opaque_8x", ".1%"),
    Measure("ripple of flat walls there (1/255)", "ripple", ".2f"),
    Measure("seen by a photo (%)", "seen", ".1%"),
)
_SCENE = (
    Measure("Gaussians", "gaussians", ",.0f"),
    Measure("bytes of its file", "bytes", ",.0f"),
    Measure("seconds to make it", "seconds", ".2f"),
)
GROUPS = {
    "photos": ("The photos' own places, at the photo's size", _PICTURE),
    "between": ("A kept photo from between, at its size", _PICTURE),
    "between_small": ("A kept photo from between, at the network's size", _PICTURE[:-1]),
    "once": ("A scene", _SCENE),
}
"""Title and measures of each group."""
_TITLES = {GRID: "photo through the grid", OTHER: "other version"}


@dataclass(frozen=True)
class Bench(benches.Bench):
    """ways: how scenes are made. beside: a folder of NAME.langflash of another version. keep: where scenes
    are written, WAY/NAME.langflash."""

    ways: tuple[str, ...] = WAYS
    beside: Path | None = None
    keep: Path | None = None


@dataclass(frozen=True)
class Column:
    """A scene that is judged, without its language; bytes of its file, seconds (NaN: not known)."""

    name: str
    scene: Scene
    bytes: int
    seconds: float


@dataclass(frozen=True)
class Truth:
    """A picture at the size it is compared at, with the pixels that count (None: all)."""

    rgb: Tensor
    counted: Tensor | None = None

    @property
    def size(self) -> tuple[int, int]:
        """(width, height)."""
        return self.rgb.shape[1], self.rgb.shape[0]


def run_sharp(
    subjects: Iterable[Subject],
    count: int,
    bench: Bench,
    *,
    progress: Progress = lambda stage, fraction: None,
) -> dict:
    """Judge the code that makes scenes.

    Args:
        count: of the subjects.

    Returns:
        Plain JSON: "cases" with the numbers of each, "measures" their means by column and group.

    Raises:
        InputError: there is no subject, or a way or a scene beside is missing.
    """
    tallies = judged(
        ((subject.name, subject) for subject in subjects),
        lambda subject, _: Rows([judge(subject, bench)]),
        count=count,
        progress=progress,
    )
    rows = [row for tally in tallies.values() for row in tally.rows]
    made = {"weights": bench.made_with, "ways": list(bench.ways)}
    return {**made, "measures": summary(rows), "cases": rows}


def judge(subject: Subject, bench: Bench, shown: Shown | None = None) -> dict:
    """Numbers of one subject: "columns" by name, each with its groups. shown: gets close-ups.

    Raises:
        InputError: as `run_sharp`.
    """
    made = list(_columns(subject, bench))
    grid = made[0].scene.view_size
    views = range(min(column.scene.num_views for column in made))
    photos = [subject.photo(view) for view in views]
    own = [Truth(picture_of(as_seen(photo, size_of(photo, grid)))) for photo in photos]
    pictures = {"photo": own[0].rgb}
    with torch.no_grad():
        kept = _kept(subject, grid, len(views))
        columns: dict[str, dict] = {GRID: _grid_row(own, kept, grid, bench.lpips)}
        for column in made:
            columns[column.name], pictures[column.name] = _scene_row(column, own, kept, bench)
    pictures[GRID] = on_grid(own[0].rgb, grid)
    if shown is not None:
        shown(_sight(subject.name, pictures, columns[bench.ways[-1]]["photos"]))
    return {"name": subject.name, "grid": list(grid), "size": list(own[0].size), "columns": columns}


def _sight(name: str, pictures: Mapping[str, Tensor], row: Mapping[str, float]) -> Sight:
    """Close-ups, with the numbers of the last way from the photos' own places."""
    told = ("psnr", "lpips", "detail", "opaque")
    numbers = {key: row[key] for key in told if row.get(key) is not None}
    return Sight(name, name, closeups(pictures, 1), numbers, numbers.get("psnr", 0.0))


def _columns(subject: Subject, bench: Bench) -> Iterator[Column]:
    """Every scene of a subject, the ways first."""
    sizes = set()
    with subject.files() as paths, TemporaryDirectory() as folder:
        for way in bench.ways:
            start = time.perf_counter()
            detailed = None if way == PLAIN else way
            scene = bench.scene(paths, detail=detailed, intrinsics=subject.intrinsics)
            seconds = time.perf_counter() - start
            path = (bench.keep or Path(folder)) / way / f"{subject.name}.langflash"
            make_folder(path.parent)
            save(scene, path)
            sizes.add(scene.view_size)
            yield Column(way, _flat(scene), path.stat().st_size, seconds)
    if bench.beside is not None:
        path = bench.beside / f"{subject.name}.langflash"
        scene = load(path)
        if scene.view_size not in sizes:
            saw = " x ".join(map(str, scene.view_size))
            raise InputError(f"{path} saw its photos at {saw}, not as here; make it with the same --size")
        yield Column(OTHER, _flat(scene), path.stat().st_size, math.nan)


def _flat(scene: Scene) -> Scene:
    """One layer without language, so that nobody draws weight maps at eight times the photo's size."""
    return wordless(scene).with_record(layered=False)


@dataclass(frozen=True)
class Kept:
    """The photo from between at both sizes, and the photos at the network's as `aligned` takes them."""

    look: Look
    photos: tuple[Look, ...]
    large: Truth
    small: Truth

    def camera(self, scene: Scene, render: Render) -> Camera:
        """Where it was taken, in the scene: by the surfaces that the photos draw, or, where there are no
        depths, by the distance of the cameras."""
        if all((photo.view.depths > 0).any() for photo in self.photos):
            drawn = [covered_depths(render(scene, scene.camera(view))) for view in range(len(self.photos))]
            return camera_of(self.look, aligned(scene, self.photos, drawn))
        true, own = (np.linalg.norm(m[:3, 3]) for m in (self.photos[1].view.viewmat, scene.viewmats[1]))
        fit = Similarity(float(true / max(float(own), 1e-9)), np.eye(3), np.zeros(3))
        return camera_of(self.look, fit)


def _kept(subject: Subject, grid: tuple[int, int], placed: int) -> Kept | None:
    """None where nothing was kept, or nobody knows where it is; where depths are known, pixels that a photo
    sees count."""
    if subject.between is None:
        return None
    first = subject.photo(0)
    photos = tuple(photo_look(subject.photo(view), first, grid, "photos") for view in range(placed))
    look = photo_look(subject.between, first, grid, "between")
    known = all((other.view.depths > 0).any() for other in (look, *photos))
    if not known and placed < 2:
        return None
    size = size_of(subject.between, grid)
    small = large = None
    if known:
        small = torch.from_numpy(seen_by(look.view, [photo.view for photo in photos]))
        if not bool(small.any()):
            return None
        large = torch.nn.functional.interpolate(small[None, None].float(), size=size[::-1])[0, 0] > 0.5
    return Kept(
        look, photos, Truth(picture_of(as_seen(subject.between, size)), large), Truth(look.rgb, small)
    )


def _grid_row(own: Sequence[Truth], kept: Kept | None, grid: tuple[int, int], lpips: Lpips | None) -> dict:
    """The photos as the grid can hold them."""
    rows = []
    for truth in own:
        rgb = on_grid(truth.rgb, grid)
        period = truth.size[0] / grid[0]
        rows.append({**_alike(rgb, truth, lpips), "lattice": lattice(rgb, truth.rgb, period)})
    groups = {"photos": _means(rows)}
    if kept is not None:
        groups["between"] = rounded(_alike(on_grid(kept.large.rgb, grid), kept.large, lpips))
    return groups


def _scene_row(column: Column, own: Sequence[Truth], kept: Kept | None, bench: Bench) -> tuple[dict, Tensor]:
    """Groups of a scene, and what it shows from its first photo's place."""
    scene, rows, first = column.scene, [], own[0].rgb
    for view, truth in enumerate(own):
        camera = scene.camera(view, *truth.size)
        rgb, row = _drawn(scene, camera, truth, bench)
        first = rgb if view == 0 else first
        period = truth.size[0] / scene.view_size[0]
        row |= {"lattice": lattice(rgb, truth.rgb, period), **_enlarged(scene, camera, truth, period, bench)}
        rows.append(row)
    groups = {"photos": _means(rows)}
    if kept is not None:
        camera = kept.camera(scene, bench.render)
        for group, truth in (("between", kept.large), ("between_small", kept.small)):
            groups[group] = rounded(_drawn(scene, camera.with_size(*truth.size), truth, bench)[1])
    once = {
        "gaussians": float(len(scene.gaussians)),
        "bytes": float(column.bytes),
        "seconds": column.seconds,
    }
    return {**groups, "once": rounded(once)}, first


def _drawn(scene: Scene, camera: Camera, truth: Truth, bench: Bench) -> tuple[Tensor, dict[str, float]]:
    frame = bench.render(scene, camera)
    rgb = frame.rgb.cpu().float()
    alphas = frame.alphas.cpu().float()
    numbers = _alike(rgb, truth, bench.lpips)
    numbers["opaque"] = opaque(alphas, truth.counted)
    numbers["through"] = let_through(alphas, truth.counted)
    if truth.counted is not None:
        numbers["seen"] = float(truth.counted.float().mean())
    return rgb, numbers


def _alike(rgb: Tensor, truth: Truth, lpips: Lpips | None) -> dict[str, float]:
    """What any picture is judged by."""
    check_pictures(rgb, truth.rgb)
    kept = torch.ones(truth.rgb.shape[:2], dtype=torch.bool) if truth.counted is None else truth.counted
    numbers = {
        "psnr": psnr(rgb[kept], truth.rgb[kept]),
        "detail": detail(rgb, truth.rgb, truth.counted),
        "true_detail": true_detail(rgb, truth.rgb, truth.counted),
    }
    if lpips is not None and truth.counted is None:
        numbers["lpips"] = lpips.whole(rgb[None], truth.rgb[None])[0]
    elif lpips is not None:
        numbers["lpips"] = lpips(rgb[None], truth.rgb[None], kept[None])[0]
    return numbers


def _enlarged(scene: Scene, camera: Camera, truth: Truth, period: float, bench: Bench) -> dict[str, float]:
    """What eight times the photo's size shows, in a few windows."""
    side = min(window_side(period), *truth.size)
    wide = min(2 * side, *truth.size)
    alphas = [
        bench.render(scene, crop_camera(camera, corner, wide, ENLARGED)).alphas.cpu().float()
        for corner in spread_windows(truth.size, wide)
    ]
    flat = [
        bench.render(scene, crop_camera(camera, corner, side, ENLARGED)).rgb.cpu().float()
        for corner in flat_windows(truth.rgb, side)[:FLATTEST]
    ]
    return {"opaque_8x": opaque(torch.stack(alphas).flatten(0, 1)), "ripple": ripple(flat, ENLARGED * period)}


def _means(rows: Sequence[Mapping[str, float]]) -> dict[str, float | None]:
    return rounded({key: nan_mean(number(row.get(key)) for row in rows) for key in rows[0]})


def summary(rows: Sequence[dict]) -> dict[str, dict[str, dict]]:
    """Means over cases by column and group, so that every case counts alike."""
    measures: dict[str, dict[str, dict]] = {}
    for column in dict.fromkeys(name for row in rows for name in row["columns"]):
        held = [row["columns"][column] for row in rows if column in row["columns"]]
        for group in dict.fromkeys(name for groups in held for name in groups):
            found = [groups[group] for groups in held if group in groups]
            keys = dict.fromkeys(key for numbers in found for key in numbers)
            means = {key: nan_mean(number(numbers.get(key)) for numbers in found) for key in keys}
            measures.setdefault(column, {})[group] = rounded(means)
    return measures


def tables(result: dict) -> list[Table]:
    """Means of each group, a column a column; and what the last way has before every other one."""
    means = [means_table(result["measures"], group) for group in GROUPS]
    return [*means, differences_table(result)] if "cases" in result else means


def means_table(measures: Mapping[str, Mapping[str, Mapping]], group: str) -> Table:
    """A row a measure."""
    title, told = GROUPS[group]
    columns = {_TITLES.get(c, c): measures[c][group] for c in _ordered(measures) if group in measures[c]}
    return by_measure(title, "measure", columns, told)


def differences_table(result: dict) -> Table:
    """The last way minus each rival, case by case; a row a measure of a group."""
    own, cases = result["ways"][-1], result["cases"]
    rivals = [column for column in _ordered(result["measures"]) if column != own]
    rows = []
    for group, (title, measures) in GROUPS.items():
        for measure in measures:
            pairs = [paired(cases, own, rival, group, measure.key) for rival in rivals]
            cells = [told_difference(measure, each) for each in pairs]
            if any(cell != "-" for cell in cells):
                rows.append((f"{title}: {measure.title}", *cells))
    header = (f"{own} minus", *(_TITLES.get(rival, rival) for rival in rivals))
    return Table(f"Differences over {len(cases)}, mean ± standard error", header, rows)


def paired(cases: Sequence[Mapping], own: str, rival: str, group: str, key: str) -> Pairs:
    """A measure of a rival and of a column, case by case."""
    rows = [row["columns"] for row in cases]
    first, second = (
        [number(row.get(column, {}).get(group, {}).get(key)) for row in rows] for column in (rival, own)
    )
    return list(zip(first, second, strict=True))


def _ordered(measures: Mapping[str, object]) -> list[str]:
    """The grid first, the other version last."""
    return sorted(measures, key=lambda column: (column != GRID, column == OTHER))
