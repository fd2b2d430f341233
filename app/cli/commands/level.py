"""`langflash level`: how a scene stands, and how large it is."""

import re
from argparse import Namespace
from typing import TYPE_CHECKING, TextIO

from langflash_core.base.files import check_output_file, make_folder
from langflash_core.errors import InputError

from ..files import checked_scene
from ..report import tell

if TYPE_CHECKING:
    from langflash_core.types import Scene

_PIXEL = re.compile(r"(\d+):([\d.]+),([\d.]+)")


def run(args: Namespace, out: TextIO) -> None:
    """Find or take up, floor, north and scale, say them, and keep them in the scene of -o."""
    checked_scene(args.scene)
    if args.output is not None:
        same = args.scene.suffix.lower() == ".langflash"  # which nothing is lost of
        check_output_file(args.output, (".langflash", ".ply", ".glb"), inputs=[] if same else [args.scene])
    first, last, told = args.length or ("", "", "")
    metres = _metres(told) if told else None
    from langflash_core import level
    from langflash_core.base.records import world_to_json
    from langflash_core.export import export
    from langflash_core.scene.report import world_line

    from ..scenes import open_scene

    scene = open_scene(args.scene, args.axes)
    world = level.found_world(scene, up=args.up, north=args.north, origin=args.origin)
    scene = scene.with_record(world=world)
    if metres is not None:
        scene = level.apply_measurement(scene, _place(scene, first), _place(scene, last), metres)
    for name in ("ceiling", "door"):
        if getattr(args, name) is not None:
            scene = level.measured_by(scene, name, getattr(args, name))
    if args.output is not None:
        make_folder(args.output.parent)
        export(scene, args.output)
    known, said = scene.record.metric_scale, str(args.output or args.scene)
    lines = [f"{said}: {world_line(world, known)}"]
    if known:
        lines.append(f"1 unit = {known:.4g} m, as you said")
    elif world.guess is not None:
        lines.append("give --length, --ceiling or --door to set the scale")
    tell(args, {"scene": said, "metric_scale": known, "world": world_to_json(world)}, lines, out)


def _place(scene: "Scene", text: str) -> tuple[float, float, float]:
    """A point of the scene, or what a pixel of a photo shows.

    Raises:
        InputError: it is neither.
    """
    from langflash_core.level import seen_at

    pixel = _PIXEL.fullmatch(text)
    if pixel and int(pixel[1]) == 0:
        raise InputError(
            f"photos count from 1; {text} of --length names none, 1:{pixel[2]},{pixel[3]} the first"
        )
    if pixel:
        return seen_at(scene, int(pixel[1]) - 1, float(pixel[2]), float(pixel[3]))
    try:
        x, y, z = map(float, text.split(","))
    except ValueError:
        raise InputError(f"--length takes points X,Y,Z or pixels PHOTO:U,V; received {text!r}") from None
    return x, y, z


def _metres(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.001 <= value <= 1000:
        raise InputError(f"--length takes metres from 0.001 to 1000; received {text!r}")
    return value
