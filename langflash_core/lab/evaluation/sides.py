"""`lab eval sides`: scenes seen from aside, in rooms that can be drawn from anywhere and real photos.

Two photos go through the whole program. The scene is brought into the true world by one similarity, fitted
to the surfaces that both photos draw (`fitted_similarity`), so that a wrong pose or scale is not counted
again in every picture; what a wrong pose does to the scene itself, two layers of one surface, stays. Then
it is drawn from the photos' own places, by its own cameras, and from true places elsewhere.

Sizes: H W pixels of the network's photos.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from langflash_core.base.running import Progress
from langflash_core.geometry.fusion import DepthView
from langflash_core.lab.evaluation.bench import Bench, Render, as_array
from langflash_core.lab.evaluation.metrics import pose_error
from langflash_core.lab.evaluation.side_measures import (
    Similarity,
    boundary_f1,
    fitted_similarity,
    layer_gaps,
    levelled,
    points_of,
    quantile,
    seen_by,
    shared_surface,
    sheets,
)
from langflash_core.lab.evaluation.side_subjects import Case, Look, Subject
from langflash_core.lab.evaluation.tables import (
    Measure,
    Numbers,
    Pairs,
    Table,
    by_measure,
    by_row,
    number,
    rounded,
)
from langflash_core.lab.evaluation.tallies import Rows, judged
from langflash_core.lab.training.losses import ssim_map
from langflash_core.lab.training.measures import nan_mean, psnr
from langflash_core.language.settings import ANSWERING
from langflash_core.scene.gaps import fill_gaps
from langflash_core.types import Camera, Frame, Scene

PERCEIVED = ("0", "20")
"""Groups of looks that LPIPS judges: half a second a picture, so not all."""
FILLED = "_filled"
"""Ends what is measured with gaps filled. A version that did not fill them showed its holes black."""
LOOKS = (
    Measure("PSNR, holes black (dB)", "psnr"),
    Measure("PSNR of what is covered (dB)", "psnr_covered"),
    Measure("PSNR, gaps filled (dB)", "psnr_filled"),
    Measure("SSIM", "ssim"),
    Measure("LPIPS, holes black", "lpips"),
    Measure("LPIPS, gaps filled", "lpips_filled"),
    Measure("sheets (% of drawn)", "sheets", "share"),
    Measure("holes (% of seen)", "holes", "share"),
    Measure("seen by a photo (%)", "seen", "share"),
)
ONCE = (
    Measure("Depth boundaries in the photos, F1", "boundary_f1"),
    Measure("Layers: distance of the two photos' surfaces, median (% of depth)", "layers_median", "share"),
    Measure("Layers, 90th percentile (% of depth)", "layers_p90", "share"),
    Measure("Distance of drawn points from their true places, median (% of depth)", "misfit", "share"),
    Measure("Rotation error, median (degrees)", "rotation_median"),
    Measure("Direction error, median (degrees)", "direction_median"),
    Measure("Second photo found its place", "placed"),
    Measure("Reconstruction, seconds", "seconds"),
)


def run_sides(
    cases: Iterable[Case],
    count: int,
    bench: Bench,
    progress: Progress = lambda stage, fraction: None,
) -> dict:
    """Judge a checkpoint, and the code that runs it.

    Args:
        count: of the cases.

    Returns:
        Plain JSON: "cases" with the numbers of each, "measures" and "by_look" their means.

    Raises:
        InputError: there is no case. WeightsError: the checkpoint does not fit.
    """
    named = ((case.name, case) for case in cases)
    tallies = judged(named, lambda case, _: Rows([judge(case, bench)]), count=count, progress=progress)
    rows = [row for tally in tallies.values() for row in tally.rows]
    return {"weights": bench.made_with, **summary(rows), "cases": rows}


def judge(case: Case, bench: Bench) -> dict:
    """Numbers of one case: "looks" by name, each with its "group", and what its scene has once.

    Raises:
        InputError: its truth is not known. WeightsError: the checkpoint does not fit.
    """
    scene, seconds = bench.scene_of(case.photos)
    row = judge_scene(scene, case.truth(scene.view_size), bench)
    return {"name": case.name, "seconds": round(seconds, 3), **row}


@dataclass(frozen=True)
class Drawn:
    """What a scene shows from where a look was taken; `seen` (H, W): the pixels that are judged."""

    look: Look
    frame: Frame
    seen: np.ndarray


@torch.no_grad()
def judge_scene(scene: Scene, subject: Subject, bench: Bench) -> dict:
    """Numbers of a scene of `subject.photos`; photos without a place are the last ones, and left out."""
    render = bench.render
    placed = subject.photos[: scene.num_views]
    own = [render(scene, scene.camera(view)) for view in range(len(placed))]
    depths = [covered_depths(frame) for frame in own]
    fit = aligned(scene, placed, depths)
    photos = [look.view for look in subject.photos]
    levels = [
        replace(view, depths=levelled(view.depths, drawn * fit.scale))
        for view, drawn in zip(photos, depths, strict=False)
    ]
    pictures = [
        Drawn(look, frame, np.ones(look.view.depths.shape, dtype=bool))
        for look, frame in zip(placed, own, strict=True)
    ]
    for look in subject.others:
        pictures.append(Drawn(look, render(scene, camera_of(look, fit)), seen_by(look.view, photos)))
    looks = {
        drawn.look.name: {"group": drawn.look.group, **rounded(_judged(drawn, fit, levels, bench))}
        for drawn in pictures
    }
    gaps = layers(scene, placed, render)
    edges = [boundary_f1(drawn, view.depths) for view, drawn in zip(photos, depths, strict=False)]
    once = {
        "boundary_f1": nan_mean(edges),
        "layers_median": quantile(gaps, 0.5),
        "layers_p90": quantile(gaps, 0.9),
        "misfit": _misfit(fit, scene, placed, depths),
        **_pose_errors(scene, subject),
    }
    return {"looks": looks, **rounded(once)}


def covered_depths(frame: Frame) -> np.ndarray:
    """Drawn depths (H, W), scene units; 0 where the scene covers less than half."""
    return as_array(
        torch.where(frame.alphas >= ANSWERING.covered_alpha, frame.depths, torch.zeros_like(frame.depths))
    )


def aligned(scene: Scene, placed: Sequence[Look], drawn: Sequence[np.ndarray]) -> Similarity:
    """From the scene's world to the true one, by every second pixel of every placed photo; the identity
    where nothing is drawn."""
    parts = [_pairs(scene, view, look, drawn[view]) for view, look in enumerate(placed)]
    points, truth, lengths = (np.concatenate(values) for values in zip(*parts, strict=True))
    if len(points) < 3:
        return Similarity(1.0, np.eye(3), np.zeros(3))
    return fitted_similarity(points, truth, lengths)


def _pairs(scene: Scene, view: int, look: Look, drawn: np.ndarray) -> tuple[np.ndarray, ...]:
    """Points drawn in a photo, where they truly are, and their true depths."""
    here = DepthView(drawn, as_array(scene.viewmats[view]), as_array(scene.Ks[view]))
    both = (drawn > 0) & (look.view.depths > 0)
    both[1::2], both[:, 1::2] = False, False
    return points_of(here)[both], points_of(look.view)[both], look.view.depths[both]


def _misfit(fit: Similarity, scene: Scene, placed: Sequence[Look], drawn: Sequence[np.ndarray]) -> float:
    """Median distance of a drawn point from its true place, relative to its depth, after the fit."""
    errors = []
    for view, look in enumerate(placed):
        points, truth, lengths = _pairs(scene, view, look, drawn[view])
        moved = points @ (fit.scale * fit.rotation).T + fit.shift
        errors.append(np.linalg.norm(moved - truth, axis=1) / lengths)
    return quantile(np.concatenate(errors), 0.5)


def camera_of(look: Look, fit: Similarity) -> Camera:
    """The scene's camera that stands where a look was taken."""
    viewmat, K = (torch.from_numpy(m).float() for m in (fit.viewmat(look.view.viewmat), look.view.K))
    return Camera(viewmat, K, *look.size)


def _judged(drawn: Drawn, fit: Similarity, levels: Sequence[DepthView], bench: Bench) -> dict[str, float]:
    look, seen = drawn.look, drawn.seen
    depths = covered_depths(drawn.frame) * fit.scale
    covered = int((depths > 0).sum())
    hung = sheets(replace(look.view, depths=depths), look.view.depths, levels)
    numbers = {"seen": float(seen.mean()), "sheets": hung.sum() / covered if covered else math.nan}
    if seen.any():
        rgb, shown = drawn.frame.rgb.cpu(), torch.from_numpy(seen)
        numbers["holes"] = float((depths[seen] == 0).mean())
        numbers["psnr"] = psnr(rgb[shown], look.rgb[shown])
        both = shown & torch.from_numpy(depths > 0)
        numbers["psnr_covered"] = psnr(rgb[both], look.rgb[both]) if bool(both.any()) else math.nan
        numbers["ssim"] = float(ssim_map(rgb.clamp(0, 1), look.rgb)[shown].mean())
        whole = fill_gaps(rgb, drawn.frame.alphas.cpu())
        numbers["psnr_filled"] = psnr(whole[shown], look.rgb[shown])
        if bench.lpips is not None and look.group in PERCEIVED:
            numbers["lpips"] = bench.lpips(rgb[None], look.rgb[None], shown[None])[0]
            numbers["lpips_filled"] = bench.lpips(whole[None], look.rgb[None], shown[None])[0]
    return numbers


def layers(scene: Scene, placed: Sequence[Look], render: Render) -> np.ndarray:
    """`layer_gaps` of the first two photos, from either's place; empty where there is one, or where
    nobody knows which photo brought what."""
    if len(placed) < 2 or scene.view_ids is None:
        return np.zeros(0)
    alone = [_alone(scene, view, render) for view in (0, 1)]  # [brought by][seen from]
    return np.concatenate([
        layer_gaps(alone[v][v], alone[1 - v][v], shared_surface(placed[v].view, placed[1 - v].view))
        for v in (0, 1)
    ])  # fmt: skip


def _alone(scene: Scene, view: int, render: Render) -> list[np.ndarray]:
    """Depths of what one photo brought, from the first two photos' places."""
    assert scene.view_ids is not None
    part = scene.rows(scene.view_ids == view)
    return [covered_depths(render(part, scene.camera(seen_from))) for seen_from in (0, 1)]


def _pose_errors(scene: Scene, subject: Subject) -> dict[str, float]:
    if scene.num_views < 2:
        return {"placed": 0.0, "rotation": math.nan, "direction": math.nan}
    truth = torch.from_numpy(subject.photos[1].view.viewmat)
    error = pose_error(scene.viewmats[1].cpu().double(), truth.double())
    return {"placed": 1.0, "rotation": error.rotation, "direction": error.direction}


def summary(rows: Sequence[dict]) -> dict:
    """Means over cases, each look's group first within its case, so that every case counts alike."""
    once = ("boundary_f1", "layers_median", "layers_p90", "misfit", "placed", "seconds")
    measures = {key: nan_mean(number(row[key]) for row in rows) for key in once}
    for key in ("rotation", "direction"):
        values = [number(row[key]) for row in rows]
        measures[f"{key}_median"] = float(torch.tensor(values).nanmedian())
    groups: dict[str, list[dict]] = {}
    for row in rows:
        for group, values in grouped(row).items():
            groups.setdefault(group, []).append(values)
    by_look = {
        group: rounded({key: nan_mean(number(r.get(key)) for r in several) for key in _keys(several)})
        | {"cases": len(several)}
        for group, several in sorted(groups.items(), key=lambda item: _order(item[0]))
    }
    return {"measures": rounded(measures), "by_look": by_look}


def grouped(row: dict) -> dict[str, dict[str, float]]:
    """Means of one case by group of looks."""
    groups: dict[str, list[dict]] = {}
    for look in row["looks"].values():
        groups.setdefault(look["group"], []).append(look)
    return {
        group: {key: nan_mean(number(look.get(key)) for look in looks) for key in _keys(looks)}
        for group, looks in groups.items()
    }


def _keys(rows: Sequence[dict]) -> list[str]:
    return sorted({key for row in rows for key in row} - {"group"})


def _order(group: str) -> tuple[int, float, str]:
    """0, 10, 20, ... and then words."""
    return (0, float(group), "") if group.isdigit() else (1, 0.0, group)


def tables(result: dict) -> list[Table]:
    """What a scene has once, and what it shows by where it is seen from."""
    looks = {place_name(group): row for group, row in result["by_look"].items()}
    count = len(result["cases"]) if "cases" in result else result["scenes"]
    counted = (Measure("scenes", "cases", ".0f"), *LOOKS)
    return [
        by_measure("Scenes", "measure", {f"mean of {count}": result["measures"]}, ONCE),
        by_row("Looks", "seen from", looks, counted),
    ]


def place_name(group: str) -> str:
    """Of a group of looks, for people."""
    if group == "0":
        return "the photos' own places"
    if group == "between":
        return "between the photos"
    return f"{group} degrees aside" if group.isdigit() else f"{group} degrees"


def changes(pairs: Sequence[tuple[dict, dict]]) -> Iterator[tuple[Measure, Pairs]]:
    """What became of the same cases in another version: looks of one name against each other."""
    for measure in ONCE:
        key = measure.key
        key = key.removesuffix("_median") if key.startswith(("rotation", "direction")) else key
        title = measure.title.replace(", median (degrees)", " (degrees)")
        values = [(number(old[key]), number(new[key])) for old, new in pairs]
        yield Measure(title, measure.key, measure.form), values
    looks = [tuple(map(grouped, _shared(old, new))) for old, new in pairs]
    for group in sorted({group for before, _ in looks for group in before}, key=_order):
        for measure in LOOKS:
            values = [_change(old.get(group, {}), new.get(group, {}), measure.key) for old, new in looks]
            yield Measure(f"{place_name(group)}: {measure.title}", measure.key, measure.form), values


def _shared(old: dict, new: dict) -> list[dict]:
    names = old["looks"].keys() & new["looks"].keys()
    return [
        {"looks": {name: row["looks"][name] for name in row["looks"] if name in names}} for row in (old, new)
    ]


def _change(old: Numbers, new: Numbers, key: str) -> tuple[float, float]:
    return number(old.get(key, old.get(key.removesuffix(FILLED)))), number(new.get(key))
