"""`langflash tour`: stops and notes of a scene, listed, changed, and as JSON."""

import json
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

from langflash_core.base.files import (
    check_output_file,
    check_same_kind,
    make_folder,
    readable_file,
    write_atomically,
)
from langflash_core.base.limits import TEXT
from langflash_core.errors import InputError, SceneFileError, ViewError
from langflash_core.geometry.poses import Vector
from langflash_core.scene.container import Container
from langflash_core.scene.tour import Note, Stop, Tour, read_tour, told_tour
from langflash_core.showing.tours import (
    place_of,
    pose_of_camera,
    pose_of_view,
    stop_at,
    tour_in,
    write_tour,
)

from ..report import tell

FORMAT, VERSION = "langflash-tour", 1
SUFFIX = ".langflash"


def run(args: Namespace, out: TextIO) -> None:
    """List, change or exchange the tour of a scene file; its Gaussians stay as they are, bit by bit."""
    readable_file(args.scene, "scene", SceneFileError)
    if args.scene.suffix.lower() != SUFFIX:
        raise InputError(f"{args.scene.name} cannot hold a tour; export it to a {SUFFIX} scene first")
    output: Path | None = getattr(args, "output", None)
    if output is not None:
        suffix = ".json" if args.action == "export" else SUFFIX
        check_output_file(output, (suffix,), inputs=[args.scene])
        if args.action == "export":
            check_same_kind(output, ("format", "version"))
    tour, found = tour_in(args.scene)
    if args.action == "list":
        document = {**told_tour(tour), "metric_scale": found.metadata.get("metric_scale")}
        return tell(args, document, _lines(tour, found), out)
    if output is not None:
        make_folder(output.parent)
    if args.action == "export":
        content = {"format": FORMAT, "version": VERSION, **told_tour(tour)}
        write_atomically(args.output, json.dumps(content, indent=1, ensure_ascii=False).encode())
    else:
        tour = _CHANGES[args.action](args, tour, found)
        write_tour(tour, found, output or args.scene)
    start = f", opens at {tour.start}" if tour.start else ""
    print(f"{output or args.scene}: {len(tour.stops)} stops, {len(tour.notes)} notes{start}", file=out)
    return None


def _lines(tour: Tour, found: Container) -> Iterator[str]:
    for number, stop in enumerate(tour.stops, 1):
        start = " (start)" if stop.name == tour.start else ""
        yield f"stop {number}: {stop.name}{start}{_more(stop)}"
    scale = found.metadata.get("metric_scale")
    for number, note in enumerate(tour.notes, 1):
        line = f"note {number} at {', '.join(f'{value:.2f}' for value in note.at)}"
        if note.length is not None:
            line += f", {note.length * scale:.2f} m" if scale else f", {note.length:.3f} scene units"
        yield line + _more(note)
    if not tour:
        yield 'no tour; begin one with: langflash tour stop SCENE "The window"'


def _more(told: Stop | Note) -> str:
    return (f": {told.text}" if told.text else "") + (f' [asks "{told.phrase}"]' if told.phrase else "")


# What each action makes of the tour


def _with_stop(args: Namespace, tour: Tour, found: Container) -> Tour:
    if args.camera is None:
        pose = pose_of_view(found, args.view or 0)
    else:
        readable_file(args.camera, "camera file", ViewError)
        from langflash_core.writing.cameras import read_camera

        pose = pose_of_camera(found, read_camera(args.camera))
    place = None if args.place is None else args.place - 1
    tour = tour.with_stop(Stop(args.name, pose, args.text, args.phrase), place)
    return tour.started(" ".join(args.name.split())) if args.start else tour


def _with_note(args: Namespace, tour: Tour, found: Container) -> Tour:
    if args.at is None and not args.phrase:
        raise InputError('a note needs a place: say --at X,Y,Z, or --phrase "armchair" for what that finds')
    to = None if args.to is None else Vector(*args.to)
    if args.at is not None:
        at = Vector(*args.at)
    else:
        from ..renderers import open_renderer
        from ..scenes import open_scene

        with open_renderer(args.backend) as renderer:
            at = place_of(open_scene(args.scene), args.phrase, renderer)
    return tour.with_note(Note(args.text or args.phrase, at, to, args.phrase))


def _without(args: Namespace, tour: Tour, found: Container) -> Tour:
    if not args.stops and not args.note:
        raise InputError("nothing was named; name stops, or notes with --note 1")
    for number in args.note:
        if number > len(tour.notes):
            raise InputError(f"there is no note {number}; the tour has {len(tour.notes)}")
    places = {stop_at(tour, said) for said in args.stops}
    for place in sorted(places, reverse=True):
        tour = tour.without_stop(place)
    for number in sorted(set(args.note), reverse=True):
        tour = tour.without_note(number - 1)
    return tour


def _ordered(args: Namespace, tour: Tour, found: Container) -> Tour:
    first = list(dict.fromkeys(stop_at(tour, said) for said in args.stops))
    rest = [place for place in range(len(tour.stops)) if place not in first]
    return Tour(tuple(tour.stops[place] for place in first + rest), tour.notes, tour.start)


def _started(args: Namespace, tour: Tour, found: Container) -> Tour:
    return tour.started("" if args.stop is None else tour.stops[stop_at(tour, args.stop)].name)


def _imported(args: Namespace, tour: Tour, found: Container) -> Tour:
    path: Path = args.file
    readable_file(path, "tour", InputError)
    TEXT.check(path.stat().st_size, path.name, InputError)
    try:
        content: Any = json.loads(path.read_bytes())
        if content["format"] != FORMAT:
            raise ValueError("it is of another kind")
        if int(content["version"]) > VERSION:
            raise InputError(f"{path.name} was written by a newer LangFlash; update LangFlash")
        return read_tour(content)
    except (ValueError, LookupError, TypeError, RecursionError) as error:
        said = " ".join(str(error).split())[:100]
        raise InputError(
            f"{path.name} holds no tour ({said}); write one with: langflash tour export"
        ) from error


_CHANGES = {
    "stop": _with_stop,
    "note": _with_note,
    "remove": _without,
    "order": _ordered,
    "start": _started,
    "import": _imported,
}
