"""`langflash info`: what a scene file holds; with --limits, how much of a file is let in."""

from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

from langflash_core.base.files import readable_file
from langflash_core.base.limits import LIMITS
from langflash_core.base.memory import told_bytes
from langflash_core.errors import InputError, SceneFileError

from ..drawn import bytes_drawn
from ..report import tell, write_json
from ..sbom import bill_of_materials

_SHOWS = 1 / 255  # the smallest step of an 8-bit picture
_SIZES = ("file_bytes", "opened_bytes", "drawn_bytes")


def run(args: Namespace, out: TextIO) -> None:
    """Print counts, sizes, timings, and what pruning saved."""
    if args.limits:
        return _tell_limits(args, out)
    if args.sbom:
        return write_json(bill_of_materials(), out)
    if args.scene is None:
        raise InputError("no scene was named; name one, or use --limits or --sbom")
    document = {
        "scene": str(args.scene),
        **_described(args.scene, args.axes),
        "file_bytes": args.scene.stat().st_size,
    }
    document["drawn_bytes"] = _drawn(document)
    return tell(args, document, _told(document), out)


def _told(document: dict[str, Any]) -> Iterator[str]:
    yield from _lines(_for_people(_in_words(document)))


def _tell_limits(args: Namespace, out: TextIO) -> None:
    widths = max(len(limit.variable) for limit in LIMITS), max(len(limit.told()) for limit in LIMITS)
    lines = (f"{one.variable:{widths[0]}}  {one.told():>{widths[1]}}  {one.what}" for one in LIMITS)
    tell(args, {"limits": {limit.name: limit.value for limit in LIMITS}}, lines, out)


def _described(path: Path, axes: str | None) -> dict[str, Any]:
    """Our own files without torch; those of other programs as the scene they become."""
    from langflash_core.scene.report import describe, describe_file

    readable_file(path, "scene", SceneFileError)
    if path.suffix.lower() == ".langflash" and axes is None:
        return describe_file(path)
    from ..scenes import open_scene

    return describe(open_scene(path, axes))


def _drawn(document: dict[str, Any]) -> int:
    """Bytes that it takes where it is drawn."""
    count = document["gaussians"]
    weights = document["bytes"]["weight_values"] // max(1, 2 * count)  # float16
    return bytes_drawn(count, (document["sh_degree"] + 1) ** 2, weights, document["layers"])


def _memory_line(document: dict[str, Any]) -> str:
    """ "14.6 MB on disk, 45.1 MB in memory, 51.9 MB more to draw it"."""
    file, opened, drawn = (told_bytes(document[name]) for name in _SIZES)
    return f"{file} on disk, {opened} in memory, {drawn} more to draw it"


def _for_people(document: dict[str, Any]) -> dict[str, Any]:
    """With detail, lens, world and what was left out as a line each, none where there is nothing to say; with
    what pruning changed; without timings, where nobody knows them."""
    from langflash_core.base.records import world_from_json
    from langflash_core.scene.report import detail_line, left_out_line, lens_line, world_line

    lines = {
        "detail": detail_line(document["detail"] or {}, document["gaussians"]),
        "lens": lens_line(document["lens"] or {}),
        "left_out": left_out_line(document["left_out"] or {}, document["photos"]),
        "timings": document["timings"] or "",
        "pruning": _pruned(document["pruning"]),
        "antialiased": document["antialiased"] or "",
        "layers": document["layers"] or "",
        "foreseen": "",  # a warning says what it means
        **dict.fromkeys(_SIZES, ""),  # a line together
    }
    world = world_from_json(document["world"]) if document["world"] else None
    lines["world"] = world_line(world, document["metric_scale"])
    told = {name: lines.get(name, value) for name, value in document.items() if lines.get(name) != ""}
    return {**told, "memory": _memory_line(document)}


def _pruned(report: dict[str, Any] | None) -> dict[str, Any] | None:
    """What pruning changed: numbers that are 0, or the same before and after, say nothing."""
    if report is None:
        return None
    changed = {}
    for name, value in report.items():
        what, _, when = name.rpartition("_")
        other = {"before": "after", "after": "before"}.get(when)
        if value not in (0, None) and (other is None or value != report.get(f"{what}_{other}")):
            changed[name.replace("weights_", "weights_above_0_")] = value
    return changed


def _in_words(fields: dict[str, Any]) -> dict[str, Any]:
    """Without a light that nobody would see; else with its ranges, for photos are many."""
    gains, offsets = (
        [value for row in (fields["light"] or {}).get(name, ()) for value in row]
        for name in ("gains", "offsets")
    )
    if not any(abs(gain - 1) > _SHOWS for gain in gains) and not any(abs(o) > _SHOWS for o in offsets):
        return {name: value for name, value in fields.items() if name != "light"}
    ranges = f"gains {min(gains):.2f} to {max(gains):.2f}, offsets {min(offsets):.3f} to {max(offsets):.3f}"
    return {**fields, "light": ranges}


def _lines(fields: dict[str, Any], indent: str = "") -> list[str]:
    """`name: value` lines; a dictionary is indented under its name."""
    lines = []
    for name, value in fields.items():
        label = f"{indent}{name.replace('_', ' ')}:"
        if isinstance(value, dict):
            lines += [label, *_lines(value, indent + "  ")] if value else []
        elif name == "warnings" and value:  # sentences, with commas in them
            lines += [f"{indent}warning: {each}" for each in value]
        else:
            lines.append(f"{label} {_plain(value)}")
    return lines


def _plain(value: object) -> str:
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "-"}[value]
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, (list, tuple)):
        return ", ".join(map(_plain, value)) or "-"
    return str(value)
