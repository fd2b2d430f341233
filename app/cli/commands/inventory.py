"""`langflash inventory`: what is in a room, and what changed since another scene of it."""

from argparse import Namespace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from langflash_core.base.files import check_output_file, make_folder
from langflash_core.base.outputs import output_of
from langflash_core.base.request import ExportRequest
from langflash_core.errors import InputError

from ..files import checked_scene
from ..report import ProgressBar, tell

if TYPE_CHECKING:
    from langflash_core.inventory import Inventory
    from langflash_core.inventory.beside import Difference
    from langflash_core.types import Scene

_UNLIKE = 1.25  # times: more than guesses of lengths are said to be off
FILES = (".html", ".csv", ".json", ".svg", ".dxf", ".langflash")


def run(args: Namespace, out: TextIO) -> None:
    """List the things of a scene, write what -o names, and compare with the scene of --beside."""
    checked_scene(args.scene)
    if args.beside is not None:
        checked_scene(args.beside)
    requests = [_request(path, args) for path in args.output or ()]
    names = [_named(text) for text in args.name or ()]
    from langflash_core.inventory import inventory
    from langflash_core.writing import prepare_output, write
    from langflash_core.writing.inventory.tables import difference_document, document

    from ..renderers import open_renderer
    from ..scenes import open_scene

    for request in requests:
        prepare_output(request)
    with ProgressBar() as progress:
        scene = open_scene(args.scene)
        progress("looking for things", 0.2)
        found = inventory(scene, threshold=args.threshold)
        scene = _renamed(scene, found, dict(names))
        found = inventory(scene, threshold=args.threshold) if names else found
        changed = None
        if args.beside is not None:
            progress("comparing", 0.5)
            other = inventory(open_scene(args.beside), threshold=args.threshold)
            from langflash_core.inventory.beside import difference

            with open_renderer(args.backend) as renderer:
                changed = difference(found, other, renderer)
        kept = scene.with_record(world=found.world)
        written = [
            (request.output, write(kept, request, renderers=partial(open_renderer, args.backend)))
            for request in requests
        ]
    said = {"scene": str(args.scene), **document(found)}
    said |= {"beside": difference_document(changed)} if changed else {}
    lines = [*_lines(found), *(_changes(changed) if changed else ())]
    tell(args, said, [*lines, *(f"{path}: {what}" for path, what in written)], out)


def _request(path: Path, args: Namespace) -> ExportRequest:
    """The order of one file."""
    same = path.suffix.lower() == ".langflash"  # which nothing is lost of
    check_output_file(path, FILES, inputs=[] if same else [args.scene])
    make_folder(path.parent)
    word = next((w for w in ("inventory", "plan") if output_of(path, w, False) is not None), None)
    return ExportRequest(path, args.scene, what=word, backend=args.backend, replace=True)


def _named(text: str) -> tuple[str, str]:
    id, equals, name = text.partition("=")
    if not equals or not id.strip():
        raise InputError(f'--name takes "chair 1=reading chair"; received {text!r}')
    return " ".join(id.split()).lower(), " ".join(name.split())


def _renamed(scene: "Scene", found: "Inventory", names: dict[str, str]) -> "Scene":
    """The scene that keeps these names; "" takes one away."""
    known = {thing.id for thing in found.things}
    for id in names:
        if id not in known:
            raise InputError(f"there is no {id!r}; the things are {', '.join(sorted(known)) or 'none'}")
    kept = {id: name for id, name in {**scene.record.thing_names, **names}.items() if name}
    return scene.with_record(thing_names=kept) if names else scene


def _lines(found: "Inventory") -> list[str]:
    """A line a thing, under its headings."""
    from langflash_core.writing.inventory.words import doubt_of, scale_note, size

    rows = [("what", f"width × depth × height, {found.unit}", "sure", "photos")]
    for thing in found.things:
        name = thing.title + (f" ({thing.id})" if thing.name else "") + ("?" if doubt_of(thing) else "")
        photos = ", ".join(str(view + 1) for view in thing.photos)
        measured = size(thing, "").strip() + (" and more" if thing.cut else "")
        rows.append((name, measured, f"{thing.sure:.0%}", photos))
    widths = [max(len(row[column]) for row in rows) for column in range(4)]
    lines = [
        "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]
    whys = dict.fromkeys(doubt for thing in found.things if (doubt := doubt_of(thing)))
    doubted = [f"?: {' or '.join(whys)}."] * bool(whys)
    return [*lines, *doubted, scale_note(found.guess, found.unit)]


def _changes(changed: "Difference") -> list[str]:
    """A line for what moved, came, went, and what nobody knows."""
    from langflash_core.writing.inventory.words import length

    lists = {
        "moved": [f"{pair.before.title} by {length(pair.by, changed.unit)}" for pair in changed.moved],
        "came": [thing.title for thing in changed.came],
        "went": [thing.title for thing in changed.went],
        "stayed": [pair.before.title for pair in changed.stayed],
        "not known": [thing.title for thing in changed.unseen],
    }
    matches, scale = f"{changed.fit.matches} of {changed.fit.tried} matches agree", changed.fit.scale
    if max(scale, 1 / scale) > _UNLIKE:
        matches += f"; its lengths are taken times {scale:.2f}, since the scales of the two differ"
    return ["", f"Beside the other scene ({matches}):"] + [
        f"  {name}: {', '.join(titles) or '-'}" for name, titles in lists.items()
    ]
