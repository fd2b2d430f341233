"""What `langflash info` says about a scene: plain JSON values. A scene file is described without torch."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from langflash_core.base.records import FoundLens, Guess, Record, World, check_light, world_to_json
from langflash_core.scene.container import damage_error, opened_bytes, read_container
from langflash_core.scene.doubts import told_warnings
from langflash_core.scene.record import from_json
from langflash_core.scene.settings import REPORT
from langflash_core.scene.tour import read_tour

if TYPE_CHECKING:
    from langflash_core.types import Scene

_PHOTO = "photo_"


def describe(scene: "Scene") -> dict:
    """Counts, bytes, timings, warnings, and extent.

    Returns:
        `gaussians, atoms, channels, weights_per_gaussian (mean), sh_degree, views, layers (how many photos
        have one of their own, or None), view_size, photos, preset, source (the splat file it came from, or
        None), antialiased (trained to be drawn so), space, bytes {field: bytes, total} as a file has them,
        opened_bytes (in memory), bounding_box and
        core_box {min, max} in scene units (None when empty), metric_scale (metres per unit or None), world
        (None, or as `Record` has it), counts,
        pruning (as `prune` left it, with `psnr_db` and `relevance_error` where they were measured),
        detail (None, or as `Record` has it),
        light (None, or gains and offsets, a row of red, green and blue per view), lens, left_out and
        foreseen (None, or as `Record` has them),
        tour (None, or the names of stops, how many notes, and the start), timings {stage: seconds, total}
        (None where they are not known, as in files), warnings`.
    """
    from langflash_core.scene.fields import to_fields  # torch

    arrays = {name: values.numpy() for name, values in to_fields(scene).items()}
    return _document(arrays, scene.semantics.space, scene.view_size, scene.record)


def describe_file(path: Path) -> dict:
    """`describe` of the scene in a file.

    Raises:
        SceneFileError: as `container.read_container`.
    """
    found = read_container(path)
    try:
        return _document(found.arrays, found.space, found.view_size, from_json(found.metadata))
    except (ValueError, LookupError, TypeError, ArithmeticError) as error:
        raise damage_error(path, error) from error


def detail_line(detail: Mapping[str, Any], now: int | None = None) -> str:
    """What a scene's detail was spent on and what it bought, for people; "" where nothing is known.

    Args:
        detail: as `Record` has it: level (a name), elements, coarse, fine (counts), by_size (counts by the
            side of an element, pixels of the photo), photos_psnr_db and plain_psnr_db (a number a photo,
            of this scene and of one Gaussian a pixel). What is missing, or is something else, is left out.
        now: Gaussians of the scene, beside which the line stands: it says that its own are those that were
            made, where some of them went since. None: it stands alone.
    """
    level = detail.get("level")
    spent = _join_words(", ", level if isinstance(level, str) else "", _elements(detail, now))
    return _join_words(" · ", spent, _bought(detail))


def _elements(detail: Mapping[str, Any], now: int | None) -> str:
    stored = detail.get("by_size")
    by_size = stored if isinstance(stored, Mapping) else {}
    made = "" if now is None or now == detail.get("elements") else " made"
    total = f"{n} Gaussians{made}" if (n := _count(detail.get("elements"))) else ""
    kinds = (f"{n} {kind}" for kind in ("coarse", "fine") if (n := _count(detail.get(kind))))
    sizes = [f"{side} px {n}" for side, value in by_size.items() if (n := _count(value))]
    if total and sizes and len(sizes) == len(by_size):  # what goes on under finer ones is of no size
        rest = detail["elements"] - sum(by_size.values())
        sizes += [f"behind others {rest:,}"] if rest > 0 else []
    parts = _join_words("; ", _join_words(", ", *kinds), _join_words(", ", *sizes))
    return _join_words(" ", total, f"({parts})" if parts else "")


def _bought(detail: Mapping[str, Any]) -> str:
    here, plain = (_decibels(detail.get(name)) for name in ("photos_psnr_db", "plain_psnr_db"))
    beside = f" ({plain} dB with one Gaussian a pixel)" if plain else ""
    return f"from the photos' places {here} dB{beside}" if here else ""


def _join_words(between: str, *parts: str) -> str:
    return between.join(filter(None, parts))


def lens_line(lens: Mapping[str, Any]) -> str:
    """What photos told of their lenses, for people; "" where nothing is known, or something else is said.

    Args:
        lens: as `Record` has it.
    """
    try:
        return "; ".join(str(FoundLens(**found)) for found in lens.get("found", ()))
    except (TypeError, ValueError):
        return ""


def left_out_line(left_out: Mapping[str, Any], names: Sequence[str] = ()) -> str:
    """What was left out of photos since the others do not show it, photos that could not be placed, and what
    became of films' frames, for people: "6 % of sofa.jpg"; "" of nothing, and where something else is said.

    Args:
        left_out: as `Record` has it. names: of the photos; without, and where two are the same, photos
            are numbered.
    """
    films = (said.rstrip(".") for said in film_sentences(left_out))
    return _join_words("; ", _shares_line(left_out_shares(left_out), names), _unplaced_note(left_out), *films)


def left_out_shares(left_out: Mapping[str, Any]) -> tuple[float, ...]:
    """Of each view the share that was left out since the others do not show it; () of something else."""
    shares = left_out.get("shares")
    if not isinstance(shares, list | tuple) or not all(isinstance(share, int | float) for share in shares):
        return ()
    return tuple(float(share) for share in shares)


def unplaced_names(left_out: Mapping[str, Any]) -> tuple[str, ...]:
    """Photos that could not be placed."""
    names = left_out.get("unplaced")
    return tuple(filter(_is_text, names)) if isinstance(names, list | tuple) else ()


def film_sentences(left_out: Mapping[str, Any]) -> list[str]:
    """What became of the frames of each film: "Of 480 frames of walk.mp4, 12 were blurred."; nothing of what
    cannot be read."""
    stored = left_out.get("films")
    said = []
    for told in stored if isinstance(stored, list | tuple) else ():
        known = told if isinstance(told, Mapping) else {}
        film, frames, why = (known.get(name) for name in ("film", "frames", "why"))
        counts = why.items() if isinstance(why, Mapping) else ()
        parts = [f"{n} {phrase}" for phrase, count in counts if (n := _count(count)) and count]
        if isinstance(film, str) and _count(frames) and parts:
            said.append(f"Of {_count(frames)} frames of {film}, {', '.join(parts)}.")
    return said


def _is_text(value: object) -> bool:
    return isinstance(value, str)


def _unplaced_note(left_out: Mapping[str, Any]) -> str:
    names = unplaced_names(left_out)
    more = f" and {_others(len(names) - REPORT.named)}" if len(names) > REPORT.named else ""
    return f"{', '.join(names[: REPORT.named])}{more} could not be placed" if names else ""


def _shares_line(shares: tuple[float, ...], names: Sequence[str]) -> str:
    some = [(share, view) for view, share in enumerate(shares) if share > 0]
    most = sorted(sorted(some, reverse=True)[: REPORT.named], key=lambda one: one[1])
    apart = len(names) == len(set(names)) == len(shares) and all(
        0 < len(name) <= REPORT.short for name in names
    )
    called = names if apart else [f"photo {number}" for number in range(1, len(shares) + 1)]
    parts = [f"{max(1, round(100 * share))} % of {called[view]}" for share, view in most]
    return ", ".join(parts) + (
        f" and some of {_others(len(some) - REPORT.named)}" if len(some) > REPORT.named else ""
    )


def _others(count: int) -> str:
    return "another one" if count == 1 else f"{count} others"


def world_line(world: World | None, metric_scale: float | None = None) -> str:
    """How a scene stands and how large it may be, for people; "" where nobody looked.

    Args:
        metric_scale: metres per scene unit where they are known: then nothing is guessed.
    """
    if world is None:
        return ""
    known = {"edges": "edges in the photos", "surfaces": "surfaces", "told": "you"}[world.up_by]
    up = f"levelled by {known}" + (f" (± {world.up_error:.1f}°)" if world.up_error else "")
    floor = {"floor": "floor found", "lowest": "no floor seen, so it stands on its lowest point"}
    north = {"walls": "north is the wall in the first photo", "told": "north as you said"}
    parts = [up, floor.get(world.floor_by, "standing on the point that you named"), north[world.north_by]]
    if world.guess is not None and metric_scale is None:
        parts.append(guess_line(world.guess))
    return "; ".join(parts)


def guess_line(guess: Guess) -> str:
    """A guessed scale, for people."""
    by = (
        ", ".join(guess.by[:-1]) + (" and " if guess.by[1:] else "") + guess.by[-1] if guess.by else "nothing"
    )
    return f"scale guessed from {by}: 1 unit ≈ {guess.metres:.2f} m (± {100 * guess.spread:.0f} %)"


def _count(value: object) -> str:
    return f"{value:,}" if isinstance(value, int) and not isinstance(value, bool) else ""


def _decibels(values: object) -> str:
    """A number a photo, or one for all; "" where there is something else among them."""
    each = values if isinstance(values, list | tuple) else [values]
    numbers = [v for v in each if isinstance(v, int | float) and not isinstance(v, bool)]
    return ", ".join(f"{v:.1f}" for v in numbers) if len(numbers) == len(each) else ""


def _document(
    arrays: Mapping[str, np.ndarray], space: str, view_size: tuple[int, int], known: Record
) -> dict:
    sizes = {name: values.nbytes for name, values in arrays.items() if not name.startswith(_PHOTO)}
    sizes["photos"] = sum(values.nbytes for name, values in arrays.items() if name.startswith(_PHOTO))
    timings, means = known.cost.timings, arrays["means"]
    check_light(known.light, len(arrays["viewmats"]))
    return {
        "gaussians": len(means),
        "atoms": len(arrays["dictionary"]),
        "channels": arrays["dictionary"].shape[1],
        "weights_per_gaussian": float((arrays["weight_values"] > 0).sum()) / max(1, len(means)),
        "sh_degree": round(arrays["sh"].shape[1] ** 0.5) - 1,
        "views": len(arrays["viewmats"]),
        "layers": _layers(arrays, known),
        "view_size": list(view_size),
        "photos": list(known.photos),
        "preset": known.preset,
        "source": known.source,
        "antialiased": known.antialiased,
        "space": space,
        "bytes": {**sizes, "total": sum(sizes.values())},
        "opened_bytes": sum(opened_bytes(name, values.size) for name, values in arrays.items()),
        "bounding_box": _box(means, (0.0, 1.0)),
        "core_box": _box(means, REPORT.core),
        "metric_scale": known.metric_scale,
        "world": None if known.world is None else world_to_json(known.world),
        "counts": dict(known.counts),
        "pruning": dict(known.pruning) or None,
        "detail": dict(known.detail) or None,
        "light": dict(known.light) or None,
        "lens": dict(known.lens) or None,
        "tour": _tour(known),
        "left_out": dict(known.left_out) or None,
        "foreseen": dict(known.foreseen) or None,
        "timings": {**timings, "total": sum(timings.values())} if timings else None,
        "warnings": list(told_warnings(known, len(arrays["viewmats"]))),
    }


def _layers(arrays: Mapping[str, np.ndarray], known: Record) -> int | None:
    """Photos with a layer of their own; None of a scene that has none."""
    if not known.layered or "view_ids" not in arrays:
        return None
    ids = np.unique(arrays["view_ids"])
    return int((ids >= 0).sum())


def _tour(known: Record) -> dict | None:
    """Names of stops, and how many notes; None where there is neither."""
    tour = read_tour(known.tour)
    return (
        {"stops": list(tour.names), "notes": len(tour.notes), "start": tour.start or None} if tour else None
    )


def _box(means: np.ndarray, quantiles: tuple[float, float]) -> dict | None:
    """Corners between two quantiles per axis, by rank."""
    if len(means) == 0:
        return None
    ordered = np.sort(means, axis=0)
    low, high = (ordered[round(q * (len(means) - 1))].tolist() for q in quantiles)
    return {"min": low, "max": high}
