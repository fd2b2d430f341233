"""A result as JSON, CSV and a table to read."""

import csv
import io
import math
from collections.abc import Sequence

import numpy as np

from langflash_core.surface.settings import PRUNING

from .cases import Case
from .errors import Errors
from .measure import Result, Stages, Times
from .modes import Mode, described_default

FORMAT = 1
_NUMBERS = {  # of a row: its column's heading in the table, and its format there
    "ms_median": ("ms", ".1f"),
    "ms_p95": ("p95", ".1f"),
    "times_default": ("x default", ".3f"),
    "cpu_ms_median": ("CPU ms", ".1f"),
    "gpu_ms_median": ("GPU ms", ".1f"),
    "query_ms": ("query ms", ".2f"),
    "phrase_ms": ("phrase ms", ".2f"),
    "psnr_db": ("PSNR dB", ".1f"),
    "relevance_mean": ("rel. mean", ".1e"),
    "relevance_max": ("rel. max", ".1e"),
    "mask_iou": ("mask IoU", ".4f"),
}
COLUMNS = ("mode", "axis", *_NUMBERS)


def document(machine: dict, results: Sequence[Result]) -> dict:
    """Everything measured, as plain JSON values; what could not be measured is null."""
    return {"format": FORMAT, "machine": machine, "cases": [_case(result) for result in results]}


def csv_text(document: dict) -> str:
    """One line a row of the document, its case before it."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(("case", *COLUMNS))
    for case in document["cases"]:
        for row in case["rows"]:
            values = (row[name] for name in COLUMNS)
            writer.writerow((case["name"], *("" if value is None else value for value in values)))
    return stream.getvalue()


def table(document: dict) -> str:
    """For people: the machine, then a table for each case."""
    machine = document["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    threads = "".join(f", {name}={value}" for name, value in machine["threads"].items())
    lines = [
        f"GPU: {machine['gpu']} ({machine['vendor']}), {machine['driver']}",
        f"CPU: {machine['processor']}, {machine['cpus']} processors{threads}, load {machine['load']}",
        f"{versions}; {machine['system']}",
    ]
    for case in document["cases"]:
        lines += ["", *_case_lines(case)]
    return "\n".join(lines)


def _case(result: Result) -> dict:
    case, stages = result.case, result.stages
    width, height = case.size
    phrases = list(case.compiled.texts)
    base = result.rows[0][1].frames
    return {
        "name": f"{case.name}, {width} x {height}, {len(phrases)} phrase{_s(len(phrases))}",
        "scene": _scene(case),
        "picture": [width, height],
        "query": {
            "phrases": phrases,
            "negatives": list(case.compiled.negative_texts),
            "mode": case.compiled.mode,
            "threshold": case.compiled.threshold,
        },
        "path": _path(result),
        "default": described_default(case.scene),
        "stages": _stages(case, stages),
        "rows": [_row(mode, times, errors, base) for mode, times, errors in result.rows],
    }


def _scene(case: Case) -> dict:
    gaussians, semantics = case.scene.gaussians, case.scene.semantics
    return {
        "name": case.name,
        "gaussians": len(gaussians),
        "atoms": semantics.num_atoms,
        "channels": semantics.dictionary.shape[1],
        "rank": case.compiled.factor.shape[1],
        "weights_per_gaussian": semantics.weight_ids.shape[1],
        "weights_above_cut": round(float((semantics.weight_values >= PRUNING.cut).sum(-1).float().mean()), 3),
        "sh_bases": gaussians.sh.shape[1],
        "space": semantics.space,
        "notes": list(case.notes),
    }


def _path(result: Result) -> dict:
    path = result.case.path
    degrees, way = path.step()
    return {
        "kind": path.kind,
        "frames": path.num_frames,
        "degrees_a_frame": _rounded(degrees),
        "units_a_frame": _rounded(way),
        "error_frames": list(result.error_frames),
    }


def _stages(case: Case, stages: Stages) -> dict:
    """With nanoseconds for one splat at one pixel: of the colours, and of one pass of weight maps."""
    blended = stages.layers_a_pixel * case.size[0] * case.size[1]
    passes = max(1, stages.map_passes)
    return {
        "colour_ms": _rounded(stages.colour_ms),
        "maps_ms": _rounded(stages.maps_ms),
        "map_passes": stages.map_passes,
        "layers_a_pixel": _rounded(stages.layers_a_pixel),
        "colour_ns_a_splat": _rounded(1e6 * stages.colour_ms / blended) if blended else None,
        "maps_ns_a_splat": _rounded(1e6 * stages.maps_ms / blended / passes) if blended else None,
    }


def _row(mode: Mode, times: Times, errors: Errors, base: list[float]) -> dict:
    measured = (times.cpu, times.gpu, times.answers, times.phrases)
    values = (
        _rounded(np.median(times.frames)),
        _rounded(np.percentile(times.frames, 95)),
        _rounded(np.median(np.array(times.frames) / np.array(base))),
        *(_rounded(np.median(each)) if each else None for each in measured),
        *map(_rounded, (errors.psnr, errors.relevance_mean, errors.relevance_max)),
        None if errors.mask_iou is None else round(errors.mask_iou, 5),
    )
    return dict(zip(COLUMNS, (mode.name, mode.axis, *values), strict=True))


def _case_lines(case: dict) -> list[str]:
    scene, path, stages = case["scene"], case["path"], case["stages"]
    frames, compared, passes = path["frames"], path["error_frames"], stages["map_passes"]
    lines = [
        case["name"],
        f"  {scene['gaussians']:,} Gaussians, K = {scene['atoms']}, C = {scene['channels']}, "
        f"r = {scene['rank']}, m = {scene['weights_per_gaussian']} "
        f"({scene['weights_above_cut']:.1f} above 1/255); phrases: {', '.join(case['query']['phrases'])}",
        *(f"  {note}" for note in scene["notes"]),
        f"  {frames} frame{_s(frames)} {path['kind']}, {path['degrees_a_frame']:g} degrees and "
        f"{path['units_a_frame']:g} units a frame; errors against the float64 reference at "
        f"frame{_s(len(compared))} {', '.join(map(str, compared))}",
        f"  default: {case['default']}",
        f"  of it, {stages['colour_ms']:g} ms sort and colours, {stages['maps_ms']:g} ms "
        f"{passes} pass{_s(passes, 'es')} of weight maps; {stages['layers_a_pixel']:.1f} splats a pixel",
    ]
    rows = [("mode", *(heading for heading, _ in _NUMBERS.values())), *map(_cells, case["rows"])]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (c.rjust(w) if i else c.ljust(w) for i, (c, w) in enumerate(zip(row, widths, strict=True)))
        lines.append("  " + "  ".join(cells).rstrip())
    return lines


def _cells(row: dict) -> tuple[str, ...]:
    values = ((row[name], form) for name, (_, form) in _NUMBERS.items())
    return row["mode"], *("-" if value is None else format(value, form) for value, form in values)


def _s(count: int, plural: str = "s") -> str:
    return "" if count == 1 else plural


def _rounded(value: float) -> float | None:
    """Five digits; None for what JSON cannot hold: the PSNR of equal pictures."""
    return float(f"{value:.5g}") if math.isfinite(value) else None
