"""`langflash lab eval real`: real frames of a place, in order and without poses, as any film gives them.

Of 2 N - 1 frames the first, third, fifth ... make a scene; the others are held back. All poses and the lens
come from one reconstruction of all, so that a frame that was held back is drawn from where it was taken.
Judged are the scene from its photos' own places, each beside what that photo makes alone, and from where the
frames between were taken, each beside what the two photos around it make alone.

Pictures are drawn at twice the network's size, in the light of their place, and gaps are not filled. A mean
hides the worst: it is told beside it.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from PIL import Image, ImageOps
from torch import Tensor

from langflash_core.base.picture_files import opened_picture
from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.images.pictures import centre_box
from langflash_core.lab.evaluation import bench as benches
from langflash_core.lab.evaluation.bench import wordless
from langflash_core.lab.evaluation.sharp_measures import likeness
from langflash_core.lab.evaluation.tables import Measure, Numbers, Table, markdown, number, rounded
from langflash_core.lab.training.measures import nan_mean
from langflash_core.surface.fused import fuse_layers
from langflash_core.types import Camera, Scene

TIMES = 2
"""Sides of a picture over those that the network sees."""
OWN, BETWEEN = "own", "between"
PHOTO, SCENE, ALONE = "photo", "scene", "alone"
WORST = {"psnr": min, "structure": min, "fog": max, "lpips": max}
Shown = Callable[[str, str, str, Tensor], None]
"""Is given "own" or "between", a frame's name, a title and a picture (H, W, 3)."""


MEASURES = (
    Measure("PSNR, light fitted (dB)", "psnr", ".2f"),
    Measure("structure (1 is the photo)", "structure"),
    Measure("fog (%)", "fog", "share"),
    Measure("LPIPS", "lpips"),
    Measure("covered (%)", "covered", "share"),
)
_KINDS = {
    OWN: ("at the photos' own places", "that photo alone"),
    BETWEEN: ("at frames held back", "the two photos around it alone"),
}


@dataclass(frozen=True)
class Bench(benches.Bench):
    """Draws scenes in the light of the place. fused: judged is the one surface that formats of splats get
    (`surface.fused`). alone: whether fewer photos stand beside."""

    fused: bool = False
    alone: bool = True


@dataclass(frozen=True)
class _Walk:
    """Where the placed ones of some frames were taken, in one world. lens: (fx, fy, cx, cy) of the frames."""

    frames: tuple[Path, ...]
    viewmats: Float[Tensor, "V 4 4"]
    Ks: Float[Tensor, "V 3 3"]
    size: tuple[int, int]
    lens: tuple[float, float, float, float]

    def camera(self, frame: Path) -> Camera:
        """At `TIMES` the network's size."""
        place = self.frames.index(frame)
        return Camera(self.viewmats[place], self.Ks[place], *self.size).with_size(*self.large)

    @property
    def large(self) -> tuple[int, int]:
        """(width, height) of pictures."""
        return TIMES * self.size[0], TIMES * self.size[1]

    def viewmats_of(self, frames: Sequence[Path]) -> Float[Tensor, "n 4 4"]:
        return self.viewmats[[self.frames.index(frame) for frame in frames]]


def chosen_frames(frames: Sequence[Path], photos: int) -> tuple[list[Path], list[Path]]:
    """Photos, evenly from the first frame to the last, and those held back between.

    One frame is held back between each two photos; where frames are too few for that, all the others.

    Raises:
        InputError: there are fewer frames than photos.
    """
    if photos < 2 or len(frames) < photos:
        raise InputError(
            f"{photos} photos cannot be chosen from {len(frames)} frames; "
            f"choose 2 to {len(frames)} with --photos"
        )
    places = np.linspace(0, len(frames) - 1, min(len(frames), 2 * photos - 1)).round().astype(int)
    kept = places[np.linspace(0, len(places) - 1, photos).round().astype(int)]
    return [frames[place] for place in kept], [frames[place] for place in np.setdiff1d(places, kept)]


def judge(
    frames: Sequence[Path],
    photos: int,
    bench: Bench,
    progress: Progress = lambda stage, fraction: None,
    shown: Shown = lambda kind, name, title, rgb: None,
) -> dict:
    """Numbers of one scene of so many photos.

    Returns:
        Plain JSON: what the scene took, "own" and "between" with a row a frame: numbers, and those of fewer
        photos as "alone_".

    Raises:
        InputError: there are too few frames, or too few of them find a place.
    """
    kept, held = chosen_frames(frames, photos)
    progress("places of all frames", 0.0)
    walk = _walked(sorted({*kept, *held}), bench)
    share = len(walk.frames) / (len(kept) + len(held))
    kept, held = ([frame for frame in some if frame in walk.frames] for some in (kept, held))
    if len(kept) < 2:
        raise InputError("fewer than two photos find a place beside each other; film more slowly")
    progress("the scene", 0.3)
    start, cpu = time.perf_counter(), time.process_time()
    scene = _made(kept, walk, bench)
    took = {"seconds": time.perf_counter() - start, "cpu_seconds": time.process_time() - cpu}
    rows: dict[str, dict] = {OWN: {}, BETWEEN: {}}
    for done, frame in enumerate((*kept, *held)):
        progress(frame.name, 0.5 + 0.5 * done / (len(kept) + len(held)))
        kind = OWN if done < len(kept) else BETWEEN
        fewer = _fewer(frame, kept, walk, bench) if bench.alone else None
        rows[kind][frame.name] = rounded(_row(kind, frame, scene, fewer, walk, bench, shown))
    once = {"photos": len(kept), "placed": share}
    return {**rounded({**once, "gaussians": float(len(scene.gaussians)), **took}), **rows}


def _walked(frames: Sequence[Path], bench: Bench) -> _Walk:
    scene = bench.scene(frames)
    placed = {name: view for view, name in enumerate(scene.record.photos)}
    known = tuple(frame for frame in frames if frame.name in placed)
    views = [placed[frame.name] for frame in known]
    return _Walk(known, scene.viewmats[views], scene.Ks[views], scene.view_size, _lens(scene, known[0]))


def _lens(scene: Scene, frame: Path) -> tuple[float, float, float, float]:
    """Of a frame in its own pixels: the network saw its middle."""
    with opened_picture(frame) as picture:
        width, height = ImageOps.exif_transpose(picture).size
    box = centre_box(width, height, scene.view_size)
    across, down = ((box[2] - box[0]) / scene.view_size[0], (box[3] - box[1]) / scene.view_size[1])
    K = scene.Ks[scene.record.photos.index(frame.name)].double()
    return (
        float(K[0, 0]) * across,
        float(K[1, 1]) * down,
        box[0] + float(K[0, 2]) * across,
        box[1] + float(K[1, 2]) * down,
    )


def _made(frames: Sequence[Path], walk: _Walk, bench: Bench) -> Scene:
    """The scene of some frames in the walk's world, without its language, which costs time to draw."""
    scene = bench.scene(frames, viewmats=walk.viewmats_of(frames), intrinsics=walk.lens)
    return wordless(fuse_layers(scene) if bench.fused else scene)


def _fewer(frame: Path, kept: Sequence[Path], walk: _Walk, bench: Bench) -> Scene | None:
    """What a photo makes alone, or the two around a frame that was held back, in the walk's world; None where
    those two show nothing in common."""
    some = [frame]
    if frame not in kept:
        order = sorted((*kept, frame), key=walk.frames.index)
        place = order.index(frame)
        some = order[max(0, place - 1) : place] + order[place + 1 : place + 2]
    try:
        return _made(some, walk, bench)
    except InputError:
        return None


def _row(
    kind: str, frame: Path, scene: Scene, fewer: Scene | None, walk: _Walk, bench: Bench, shown: Shown
) -> dict[str, float]:
    camera = walk.camera(frame)
    photo = framed(frame, walk.large)
    shown(kind, frame.name, PHOTO, photo)
    row: dict[str, float] = {}
    for title, begin, each in ((SCENE, "", scene), (ALONE, f"{ALONE}_", fewer)):
        if each is None:
            continue
        drawn = bench.render(each, camera)
        rgb = drawn.rgb.cpu().float().clamp(0, 1)
        shown(kind, frame.name, title, rgb)
        found = {**likeness(rgb, photo), "covered": float((drawn.alphas >= 0.5).float().mean())}
        if bench.lpips is not None:
            found["lpips"] = bench.lpips.whole(rgb[None], photo[None])[0]
        row |= {begin + key: value for key, value in found.items()}
    return row


def framed(path: Path, size: tuple[int, int]) -> Float[Tensor, "H W 3"]:
    """A frame as a picture of that (width, height): its middle, as the network saw it."""
    with opened_picture(path) as picture:
        whole = ImageOps.exif_transpose(picture).convert("RGB")
        cut = whole.resize(size, Image.Resampling.LANCZOS, box=centre_box(*whole.size, size))
    return torch.from_numpy(np.asarray(cut, np.float32) / 255)


def summary(cases: Sequence[dict]) -> dict:
    """Means and the worst of each case, by what is judged."""
    return {"cases": [{**case, "mean": _means(case), "worst": _worst(case)} for case in cases]}


def _means(case: dict) -> dict:
    return {
        kind: {key: nan_mean(row[key] for row in rows if key in row) for key in _keys(rows)}
        for kind, rows in _rows(case)
    }


def _worst(case: dict) -> dict:
    return {
        kind: {
            key: WORST[name](row[key] for row in rows if key in row)
            for key in _keys(rows)
            if (name := key.removeprefix(f"{ALONE}_")) in WORST
        }
        for kind, rows in _rows(case)
    }


def _keys(rows: list[dict]) -> list[str]:
    return list(dict.fromkeys(key for row in rows for key in row))


def _rows(case: dict) -> list[tuple[str, list[dict]]]:
    return [(kind, list(case[kind].values())) for kind in (OWN, BETWEEN) if case[kind]]


def real_markdown(result: Mapping) -> str:
    """Of each number of photos a table: means, the worst frame in brackets; beside it what fewer bring."""
    return "\n".join(markdown(_tables(case), _about(case)) for case in result["cases"])


def _about(case: Mapping) -> str:
    share = Measure("", "", "share").told(number(case["placed"]))
    return (
        f"{case['photos']} photos, {share} % of the frames placed, {case['gaussians']:,.0f} Gaussians, "
        f"{case['seconds']:.1f} s, {case['cpu_seconds']:.1f} s of the processor"
    )


def _tables(case: Mapping) -> list[Table]:
    tables = []
    for kind, (title, alone) in _KINDS.items():
        if case[kind]:
            means, worst = case["mean"][kind], case["worst"][kind]
            begins = ("", f"{ALONE}_")
            told = [(m.title, *(_told(m, begin, means, worst) for begin in begins)) for m in MEASURES]
            rows = [row for row in told if set(row[1:]) != {"-"}]
            tables.append(Table("", (f"{title}, {len(case[kind])}", "scene", alone), rows))
    return tables


def _told(measure: Measure, begin: str, means: Numbers, worst: Numbers) -> str:
    low = worst.get(begin + measure.key)
    mean = measure.told(means.get(begin + measure.key))
    return mean if low is None else f"{mean} ({measure.told(low)})"
