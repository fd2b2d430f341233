"""The words of the command line. Only the standard library is imported here."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import langflash_core
from langflash_core.errors import InputError
from langflash_core.formats import COLOUR_MAPS

from .values import (
    above_zero,
    atom_count,
    crop,
    film_seconds,
    intrinsics,
    kept_fraction,
    minutes,
    numbers,
    open_fov,
    part,
    pixel_side,
    seed,
    size,
    span,
    view_index,
    what,
    whole_count,
)

WHATS = (
    "rgb", "heat", "mask", "soft", "cutout", "labels", "instances", "depth", "boxes", "surface",
)  # fmt: skip
# langflash_core.lab.photos.layouts.LAYOUTS, which would bring torch along.
LAYOUTS = ("nyu", "coco", "ade20k", "sunrgbd", "frames")
# langflash_core.lab.evaluation.protocols.PROTOCOLS, and photos one by one.
EVAL_PROTOCOLS = ("scannet", "3dovs", "re10k", "7scenes", "nyu")
# The decisions that `bench` compares: app.bench.modes.AXES, which would bring torch along.
BENCH_AXES = (
    "precision", "relevance", "weights", "cut", "dictionary", "resolution", "detail", "rasteriser", "sort",
)  # fmt: skip


class UsageError(InputError):
    """The command line itself cannot be understood."""


class Parser(argparse.ArgumentParser):
    """argparse that reports a mistake as one sentence instead of a page."""

    def error(self, message: str) -> NoReturn:
        """Raise `message` as a `UsageError`.

        Raises:
            UsageError: always.
        """
        raise UsageError(f"{message}; see {self.prog} --help")


def build_parser() -> Parser:
    """Every command this version has."""
    parser = Parser(
        prog="langflash",
        description="Unposed photos to a 3D Gaussian scene that answers words.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"langflash {langflash_core.__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for add in (
        _add_view,
        _add_reconstruct,
        _add_batch,
        _add_query,
        _add_render,
        _add_export,
        _add_lift,
        _add_info,
        _add_bench,
        _add_bench_network,
        _add_rooms,
        _add_train,
        _add_eval,
        _add_weights,
    ):
        add(commands)
    return parser


def joined(words: Sequence[str]) -> list[str]:
    """`bench network` is a command of its own, though `bench` takes a scene; ./network names a file."""
    return ["bench-network", *words[2:]] if list(words[:2]) == ["bench", "network"] else list(words)


def _command(commands, name: str, purpose: str, **more) -> argparse.ArgumentParser:
    return commands.add_parser(name, help=purpose, description=purpose, allow_abbrev=False, **more)


def _actions(commands, name: str, purpose: str):
    command = _command(commands, name, purpose)
    return command.add_subparsers(dest="action", metavar="ACTION", required=True)


def _add_output(command: argparse.ArgumentParser, metavar: str, purpose: str) -> None:
    command.add_argument("-o", "--output", required=True, type=Path, metavar=metavar, help=purpose)


def _add_view(commands) -> None:
    view = _command(commands, "view", "open the window; photos and scenes can be dropped on it")
    view.add_argument("paths", nargs="*", type=Path, metavar="PHOTO|SCENE", help="photos, or one scene")


def _add_reconstruct(commands) -> None:
    command = _command(commands, "reconstruct", "photos of one place to a scene file")
    command.add_argument("photos", nargs="+", type=Path, metavar="PHOTO")
    _add_output(command, "SCENE", "the scene to write")
    _add_network(command)
    command.add_argument(
        "--aggregation",
        choices=("lfa", "average", "crops"),
        help="how a group gets its vector: trained, the average of dense features, or CLIP on a cut-out "
        "(default: lfa where it has weights, else average)",
    )
    command.add_argument(
        "--grouping",
        choices=("queries", "sam2"),
        help="where groups come from: trained queries, or masks of SAM 2 lifted to the scene (default: "
        "queries where they have weights, else sam2 where it is installed, else the language features)",
    )
    command.add_argument(
        "--precision",
        choices=("auto", "float32", "bfloat16"),
        default="auto",
        help="auto: bfloat16 on graphics cards and, for full, on processors with instructions for it "
        "(default: auto)",
    )
    command.add_argument(
        "--refine",
        type=above_zero,
        metavar="SECONDS",
        help="then fit poses and Gaussians to the photos, and keep that if a held-out view improves",
    )
    lens = command.add_mutually_exclusive_group()
    lens.add_argument("--fov", type=open_fov, metavar="DEG", help="field of view of the photos' longer side")
    lens.add_argument(
        "--intrinsics",
        type=intrinsics,
        metavar="FX,FY,CX,CY",
        help="in pixels of the photos as given, after EXIF orientation",
    )
    command.add_argument(
        "--poses",
        type=Path,
        metavar="PATH",
        help="a transforms.json or COLMAP text model with the photos' poses and lenses: they are not sought, "
        "and the scene is in their world and unit",
    )
    _add_json(command)


def _add_network(command: argparse.ArgumentParser) -> None:
    """Which network sees the photos, how large, and where."""
    command.add_argument(
        "--preset", choices=("mini", "full"), default="mini", help="which network (default: mini)"
    )
    command.add_argument(
        "--weights", type=Path, metavar="PATH", help="a checkpoint instead of the shipped or imported ones"
    )
    command.add_argument(
        "--size",
        type=pixel_side,
        metavar="PX",
        help="the network sees about PX x PX pixels (default: 224; full: 256)",
    )
    command.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto")


def _add_batch(commands) -> None:
    command = _command(
        commands,
        "batch",
        "many sets of photos to scenes; an interrupted run continues, and what is done is not done again",
        epilog="The exit code is 0 when all sets are done, 1 when some failed (ledger.csv says why), "
        "2 for bad input, 130 after Ctrl-C.",
    )
    command.add_argument(
        "sets",
        type=Path,
        metavar="SETS",
        help="a folder with a sub-folder of photos a place, or a .csv: per row a name and its photos, "
        "relative to the table",
    )
    _add_output(command, "OUT", "gets a folder a set, ledger.csv and summary.html")
    command.add_argument(
        "--prompt", nargs="+", metavar="PHRASE", help="answer these in each set's first view"
    )
    command.add_argument(
        "--export",
        nargs="+",
        metavar="ENDING",
        help="files to write besides the scene, as `langflash export` does: .ply, .spz, .glb, .png, "
        "transforms.json and others of the whole scene; .json (masks) and .csv (boxes) of --prompt",
    )
    command.add_argument(
        "--workers",
        type=whole_count,
        metavar="N",
        help="processes side by side, which share the processors; each needs about 1 GB "
        "(default: one a processor, as memory allows)",
    )
    command.add_argument(
        "--address",
        metavar="RAY",
        help="a Ray cluster instead of processes: host:port, auto, or local to begin one here; all its "
        "machines see photos and OUT under the same paths",
    )
    _add_network(command)
    command.add_argument(
        "--fov", type=open_fov, metavar="DEG", help="field of view of the photos' longer side, of all sets"
    )
    _add_backend(command)
    _add_json(command)


def _add_colours(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--colormap",
        choices=COLOUR_MAPS,
        default=COLOUR_MAPS[0],
        help=f"of heat-maps (default: {COLOUR_MAPS[0]}, which colour-blind eyes read too)",
    )
    command.add_argument(
        "--span", type=span, metavar="LOW,HIGH", help="relevance of its first and last colour"
    )


def _add_query(commands) -> None:
    command = _command(commands, "query", "where in a scene is each phrase? heat-maps, masks and numbers")
    command.add_argument("scene", type=Path, metavar="SCENE")
    command.add_argument("prompts", nargs="+", metavar="PROMPT", help='a phrase, e.g. "armchair"')
    _add_camera(command)
    command.add_argument(
        "--mode", choices=("relevancy", "cosine"), default="relevancy", help="(default: relevancy)"
    )
    command.add_argument(
        "--negatives",
        nargs="+",
        metavar="PHRASE",
        help="what relevancy compares with (default: the language space's own)",
    )
    _add_backend(command)
    _add_output(command, "DIR", "folder for the pictures")
    _add_json(command)
    command.add_argument(
        "--npz", action="store_true", help="also write relevance, masks, depth and rgb as arrays"
    )
    _add_colours(command)


def _add_render(commands) -> None:
    command = _command(commands, "render", "one picture of a scene")
    command.add_argument("scene", type=Path, metavar="SCENE")
    _add_output(command, "IMG", "the .png to write")
    _add_camera(command)
    command.add_argument(
        "--what",
        type=what,
        default=("rgb", None),
        metavar="rgb|depth|relevance|labels|atoms|weights:K",
        help="(default: rgb)",
    )
    command.add_argument(
        "--prompt", nargs="+", metavar="PHRASE", help="for relevance (one) and labels (any number)"
    )
    _add_fade(command)
    _add_colours(command)
    _add_backend(command)
    _add_json(command)


def _add_export(commands) -> None:
    command = _command(commands, "export", "a scene, or what answers a phrase, as a file for other programs")
    command.add_argument("scene", type=Path, metavar="SCENE")
    _add_output(
        command,
        "FILE",
        "with --segmented a folder; else .png: a picture, or a cut-out with --prompt; .langflash, .ply, "
        ".compressed.ply, .splat, .spz, .sog, meta.json (a SOG in a folder), .glb, .usd, .usda, .usdc, "
        ".usdz: Gaussians; transforms.json, cameras.txt (COLMAP): photos and their poses; "
        ".json: COCO masks of --prompt; .csv, or .glb with --what boxes: their boxes; "
        ".npz: a view as numbers; .exr: its depth; .mp4, .webp: a flight; "
        ".html: a web page that shows the scene and answers phrases",
    )
    command.add_argument(
        "--prompt",
        nargs="+",
        metavar="PHRASE",
        help="keep only what answers one of these; of an .html: shown as asked",
    )
    command.add_argument(
        "--threshold", type=kept_fraction, metavar="T", help="relevancy to keep, between 0 and 1"
    )
    command.add_argument(
        "--what",
        choices=WHATS,
        help="of a .png: colours, a heat-map, a mask, a soft mask of 16 bits, a cut-out with transparency "
        "(default with --prompt), numbers of phrases or of instances with a legend as .json, or depth in "
        "steps of 16 bits; boxes: a .json, .csv or .glb of places and sizes; surface: a .glb; of a video: "
        "heat",
    )
    command.add_argument(
        "--segmented",
        action="store_true",
        help="a folder: of every photo's view masks, soft masks, cut-outs and instances of --prompt, and "
        "depth; boxes, surfaces, a contact sheet and manifest.json",
    )
    _add_colours(command)
    command.add_argument(
        "--all-views", action="store_true", help="from every photo: FILE_0, FILE_1 and so on"
    )
    command.add_argument(
        "--with-text", action="store_true", help="an .html answers any phrase, and is 28 MB larger"
    )
    command.add_argument("--seconds", type=film_seconds, metavar="S", help="length of a video (default: 6)")
    command.add_argument(
        "--path",
        metavar="WAY",
        help="of a video: photos, from one to the next and back (default); orbit, around what is shown; or a "
        "JSON list of cameras as of --camera, each with its time in seconds, or evenly spread",
    )
    command.add_argument(
        "--replace", action="store_true", help="also what is there by the name of a legend or a COCO picture"
    )
    _add_camera(command)
    _add_fade(command)
    _add_backend(command)


def _add_lift(commands) -> None:
    command = _command(
        commands, "lift", "groups and a dictionary for plain splats, so that they answer phrases"
    )
    command.add_argument("scene", type=Path, metavar="SCENE", help="a splat file, or a scene to name anew")
    _add_output(command, "SCENE", "the .langflash, or .ply or .glb with its language, to write")
    command.add_argument(
        "--photos",
        nargs="+",
        type=Path,
        metavar="PHOTO",
        help="of the place, with --poses; else views of itself",
    )
    command.add_argument("--poses", type=Path, metavar="PATH", help="transforms.json, or a COLMAP text model")
    command.add_argument(
        "--weights", type=Path, metavar="PATH", help="a checkpoint instead of the shipped ones"
    )
    _add_backend(command)
    _add_json(command)


def _add_info(commands) -> None:
    command = _command(commands, "info", "what a scene file holds, and what pruning saved")
    command.add_argument("scene", type=Path, metavar="SCENE", help=".langflash or a splat file")
    _add_json(command)


def _add_rooms(commands) -> None:
    actions = _actions(commands, "rooms", "furnished rooms for training and tests")
    pack = _command(actions, "pack", "furniture libraries (.sh3f) to one pack")
    pack.add_argument("folder", type=Path, metavar="FOLDER")
    _add_output(pack, "PACK", "the pack to write")
    preview = _command(actions, "preview", "a contact sheet of rooms")
    preview.add_argument("pack", type=Path, metavar="PACK")
    _add_output(preview, "IMG", "the .png to write")
    _add_seeds(preview, count=9)
    render = _command(actions, "render", "rooms with depth, instances and names, one .npz each")
    render.add_argument("pack", type=Path, metavar="PACK")
    _add_output(render, "DIR", "folder to fill; rooms that are there are kept")
    _add_seeds(render, count=100)
    render.add_argument("--views", type=whole_count, default=2, metavar="V", help="(default: 2)")
    render.add_argument("--size", type=size, default=(224, 224), metavar="WxH", help="(default: 224x224)")


def _add_seeds(command: argparse.ArgumentParser, *, count: int) -> None:
    command.add_argument("--seed", type=seed, default=0, metavar="N", help="the first room (default: 0)")
    command.add_argument(
        "--count", type=whole_count, default=count, metavar="N", help=f"rooms (default: {count})"
    )
    command.add_argument("--held-out", action="store_true", help="furniture that training never sees")


def _add_train(commands) -> None:
    actions = _actions(commands, "train", "train the network on rendered rooms")
    adopt = _command(actions, "adopt", "published weights of the frozen parts to a file to start from")
    adopt.add_argument("encoder", type=Path, metavar="ENCODER", help="timm state dict, .safetensors")
    adopt.add_argument("local", type=Path, metavar="XFEAT", help="XFeat's state dict, .safetensors")
    _add_output(adopt, "FILE", "the .safetensors to write")
    adopt.add_argument("--preset", choices=("mini",), default="mini", help="(default: mini)")
    _add_cache(actions)
    _add_convert(actions)
    parts = _command(actions, "parts", "find the parts of cached rooms, for the stage naming")
    parts.add_argument("cache", type=Path, metavar="CACHE", help="made by train cache")
    parts.add_argument(
        "--run", type=Path, metavar="RUN", help="folder of train run whose stages are used (default: none)"
    )
    parts.add_argument(
        "--part", type=part, default=(0, 1), metavar="I/N", help="the I-th of N processes, from 0"
    )
    _add_start(parts)
    _add_late(actions)
    _add_stages(actions)
    export = _command(actions, "export", "all stages of a run to one checkpoint")
    export.add_argument("run", type=Path, metavar="RUN")
    _add_output(export, "FILE", "the .safetensors to write")
    export.add_argument("--metadata", type=Path, metavar="JSON", help="an object to add to the model card")
    _add_start(export, presets=("mini", "full"))


def _add_cache(actions) -> None:
    cache = _command(
        actions, "cache", "render and encode one set of rooms, or encode photos; an interrupted run continues"
    )
    cache.add_argument("pack", type=Path, nargs="?", metavar="PACK", help="made by rooms pack")
    cache.add_argument(
        "--photos",
        type=Path,
        dest="folder",
        metavar="FOLDER",
        help="instead of rooms, a folder of labelled photos as train photos makes it",
    )
    _add_description(cache)
    cache.add_argument(
        "--copies",
        type=whole_count,
        default=1,
        metavar="N",
        help="views of each photo (default: 1, as it is)",
    )
    _add_output(cache, "CACHE", "folder to fill")
    cache.add_argument("--set", choices=("train", "validation", "held_out"), default="train")
    cache.add_argument("--scenes", type=whole_count, default=4096, metavar="N", help="(default: 4096)")
    cache.add_argument("--first-seed", type=seed, metavar="N", help="(default: the set's own range)")
    cache.add_argument(
        "--part", type=part, default=(0, 1), metavar="I/N", help="the I-th of N processes, from 0"
    )
    _add_start(cache, presets=("mini", "full"))


def _add_stages(actions) -> None:
    run = _command(actions, "run", "train stages, one after the other; continues where a run stopped")
    run.add_argument("cache", type=Path, metavar="CACHE", help="made by train cache")
    _add_output(run, "RUN", "folder of checkpoints and logs")
    run.add_argument("--stages", nargs="+", metavar="STAGE", help="such as depth refine gaussians")
    run.add_argument("--minutes", nargs="+", type=minutes, metavar="M", help="one per stage")
    run.add_argument(
        "--recipe", metavar="NAME", help="instead: stages with all their numbers, 'paper' or a .toml"
    )
    _add_loop(run)
    run.add_argument(
        "--from-scratch", action="store_true", help="draw the heads anew instead of going on with --start's"
    )
    _add_start(run, presets=("mini", "full"))


def _add_late(actions) -> None:
    late = _command(
        actions, "late", "train the late half of the encoder, names and depth on labelled photos and rooms"
    )
    late.add_argument("cache", type=Path, metavar="CACHE", help="rooms, made by train cache")
    late.add_argument(
        "--photos",
        type=Path,
        dest="folder",
        metavar="FOLDER",
        required=True,
        help="labelled photos, as train photos makes them; every seventh run of numbers is kept to validate",
    )
    _add_description(late)
    _add_output(late, "RUN", "folder of checkpoints and logs")
    late.add_argument("--minutes", required=True, type=minutes, metavar="M", help="of training")
    _add_loop(late)
    _add_start(late)


def _add_loop(command: argparse.ArgumentParser) -> None:
    """What every training loop can be told."""
    command.add_argument("--max-steps", type=whole_count, metavar="N", help="stop each stage earlier")
    command.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    command.add_argument("--seed", type=seed, default=0, metavar="N")
    command.add_argument(
        "--restart", action="store_true", help="forget what the run folder holds of these stages"
    )
    command.add_argument(
        "--batches",
        type=whole_count,
        metavar="N",
        help="that a step is made of, shared by the processes (default: one each)",
    )
    command.add_argument("--precision", choices=("auto", "float32", "bfloat16"), default="auto")
    command.add_argument("--board", action="store_true", help="also write TensorBoard's logs, in RUN/board")


def _add_convert(actions) -> None:
    command = _command(actions, "photos", "a published data set to a folder of labelled photos")
    command.add_argument("layout", choices=LAYOUTS, metavar="LAYOUT", help=", ".join(LAYOUTS))
    command.add_argument("source", type=Path, metavar="SOURCE", help="the folder or file as downloaded")
    _add_output(command, "FOLDER", "folder to fill; photos that are there are kept")
    command.add_argument(
        "--splits", type=Path, metavar="FILE", help="nyu: splits.mat, for its training split"
    )
    command.add_argument("--classes", type=Path, metavar="FILE", help="nyu: classMapping40.mat")
    command.add_argument("--images", type=Path, metavar="FOLDER", help="coco: where the photos are")
    command.add_argument("--camera", type=Path, metavar="FILE", help="frames: K, nine numbers")
    command.add_argument("--limit", type=whole_count, metavar="N", help="only the first N photos")


def _add_bench(commands) -> None:
    command = _command(commands, "bench", "how fast each way of drawing is, and what it gets wrong")
    command.add_argument("scene", nargs="?", type=Path, metavar="SCENE")
    command.add_argument("--synthetic", type=whole_count, metavar="N", help="a generated room of N Gaussians")
    command.add_argument(
        "--paper",
        action="store_true",
        help="the paper's size: 131,072 Gaussians, 128 atoms, 1 and 16 phrases, 988x731 and 1920x1080",
    )
    command.add_argument(
        "--atoms", type=atom_count, metavar="K", help="generated atoms, for a scene that has none"
    )
    command.add_argument(
        "--spread", type=above_zero, metavar="F", help="generated Gaussians F times as wide: more overdraw"
    )
    command.add_argument("--prompt", nargs="+", metavar="PHRASE", help="up to 16 (default: three of a home)")
    command.add_argument(
        "--size", type=size, metavar="WxH", help="pixels to draw (default: as the network saw it)"
    )
    command.add_argument("--frames", type=whole_count, metavar="N", help="of the camera's way (default: 8)")
    command.add_argument("--only", nargs="+", choices=BENCH_AXES, help="what to compare (default: all)")
    command.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER", help="also write bench.json, bench.csv and bench.png"
    )
    _add_json(command)


def _add_bench_network(commands) -> None:
    command = _command(
        commands, "bench-network", "how long each stage of the network takes (also: bench network)"
    )
    command.add_argument("--preset", choices=("mini", "full"), default="full", help="(default: full)")
    weights = command.add_mutually_exclusive_group()
    weights.add_argument(
        "--weights", type=Path, metavar="PATH", help="(default: the shipped or imported ones)"
    )
    weights.add_argument("--random", action="store_true", help="draw them: the times are the same")
    command.add_argument(
        "--views", type=whole_count, nargs="+", default=[2], metavar="V", help="(default: 2)"
    )
    command.add_argument(
        "--atoms", type=whole_count, nargs="+", default=[128], metavar="K", help="(default: 128)"
    )
    command.add_argument(
        "--repeats", type=whole_count, default=3, metavar="N", help="the median counts (default: 3)"
    )
    command.add_argument("--size", type=pixel_side, metavar="PX", help="(default: 224; full: 256)")
    command.add_argument(
        "--float32", action="store_true", help="leave bfloat16 out, which is slow where a CPU lacks it"
    )
    command.add_argument("--compile", action="store_true", help="through torch.compile")
    command.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto")
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="also write the numbers as .json")
    _add_json(command)


def _add_eval(commands) -> None:
    actions = _actions(commands, "eval", "how good a checkpoint is on rooms it has never seen")
    rooms = _command(actions, "rooms", "geometry, pictures, labels and phrases, with trivial answers beside")
    rooms.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="also write the tables as .md (default: only print them)",
    )
    _add_json(rooms)
    calibrate = _command(actions, "calibrate", "presence threshold, as JSON for train export --metadata")
    _add_photo_sets(calibrate)
    calibrate.add_argument(
        "--plot", type=Path, metavar="IMG", help="also write the reliability diagram as .png"
    )
    for command in (rooms, calibrate):
        command.add_argument("cache", type=Path, metavar="CACHE", help="made by train cache")
        command.add_argument("--preset", choices=("mini",), default="mini", help="(default: mini)")
        command.add_argument("--weights", type=Path, metavar="PATH", help="(default: the shipped ones)")
        command.add_argument("--limit", type=whole_count, metavar="N", help="only the first N scenes")
    _add_labelled(actions)
    _add_posed(actions)
    _add_sides(actions)
    _add_protocol(actions)
    _add_report(actions)
    photos = _command(actions, "photos", "a sheet to judge by eye: pairs of photos, new views, heat-maps")
    photos.add_argument("photos", nargs="+", type=Path, metavar="PHOTO", help="first and second in turn")
    _add_output(photos, "IMG", "the .png to write")
    photos.add_argument("--weights", type=Path, metavar="PATH", help="(default: the shipped ones)")
    photos.add_argument("--prompt", nargs="+", metavar="PHRASE", help="(default: ten things of a home)")


def _add_labelled(actions) -> None:
    command = _command(
        actions, "photos-labelled", "names, presence and depth on single real photos that somebody labelled"
    )
    _add_folder(command)
    _add_choice(command, "photos, taken evenly (default: all)")
    _add_judging(command)


def _add_posed(actions) -> None:
    command = _command(actions, "posed", "poses, depth and new views on real photos of known poses")
    _add_folder(command)
    command.add_argument(
        "--apart", type=whole_count, nargs="+", metavar="N", help="numbers between two (default: 6 12 18 24)"
    )
    command.add_argument("--limit", type=whole_count, metavar="N", help="so many pairs (default: 40)")
    _add_judging(command)


def _add_sides(actions) -> None:
    command = _command(actions, "sides", "scenes seen from aside: sheets, holes, layers, pictures")
    command.add_argument(
        "pack", type=Path, nargs="?", metavar="PACK", help="rooms, drawn with this furniture"
    )
    command.add_argument(
        "--posed", type=Path, dest="folder", metavar="FOLDER", help="instead, real photos of known poses"
    )
    _add_description(command)
    command.add_argument(
        "--set", choices=("held_out", "validation"), default="held_out", help="of rooms (default: held_out)"
    )
    command.add_argument("--first-seed", type=seed, metavar="N", help="(default: the set's own range)")
    command.add_argument(
        "--apart", type=whole_count, nargs="+", metavar="N", help="numbers between two (default: 6 12 18 24)"
    )
    command.add_argument("--limit", type=whole_count, metavar="N", help="rooms or pairs (default: 100 or 40)")
    command.add_argument("--lpips", type=Path, metavar="FILE", help="LPIPS weights of VGG-16, .safetensors")
    command.add_argument(
        "--results", type=Path, metavar="DIR", help="also keep every scene's numbers, for sides-beside"
    )
    command.add_argument("--sheet", type=Path, metavar="IMG", help="also six scenes from aside, as .png")
    _add_judging(command)
    beside = _command(actions, "sides-beside", "two results of sides on the same scenes, beside each other")
    beside.add_argument("before", type=Path, metavar="BEFORE", help="folder of --results")
    beside.add_argument("after", type=Path, metavar="AFTER", help="folder of --results")
    beside.add_argument("-o", "--output", type=Path, metavar="FILE", help="also write the table as .md")
    beside.add_argument("--sheet", type=Path, metavar="IMG", help="also six scenes of both, as .png")
    beside.set_defaults(json=False)


def _add_protocol(actions) -> None:
    command = _command(actions, "protocol", "a published data set where it lies, judged as papers judge it")
    command.add_argument("name", choices=EVAL_PROTOCOLS, metavar="NAME", help=", ".join(EVAL_PROTOCOLS))
    command.add_argument("folder", type=Path, metavar="FOLDER", help="as unpacked; nyu: also its .mat")
    command.add_argument(
        "--index", type=Path, metavar="FILE", help="re10k: which views, as pixelSplat's evaluation index"
    )
    command.add_argument("--limit", type=whole_count, metavar="N", help="only the first N cases")
    command.add_argument("--lpips", type=Path, metavar="FILE", help="LPIPS weights of VGG-16, .safetensors")
    command.add_argument(
        "--work", type=Path, metavar="DIR", help="keep what is judged there, and go on from it"
    )
    _add_judging(command, ("mini", "full"))


def _add_report(actions) -> None:
    command = _command(actions, "report", "one page of everything at hand, with intervals and pictures")
    command.add_argument(
        "-o", "--output", type=Path, required=True, metavar="DIR",
        help="folder for report.html, .md, .json, .csv; a run that was ended goes on from its work/",
    )  # fmt: skip
    command.add_argument("--rooms", type=Path, metavar="CACHE", help="made by train cache: its held_out")
    command.add_argument("--posed", type=Path, metavar="FOLDER", help="real photos of known poses")
    command.add_argument("--photos", type=Path, metavar="FOLDER", help="real photos with labels")
    command.add_argument(
        "--part", choices=("all", "train", "validation"), default="all", help="of --photos (default: all)"
    )
    command.add_argument("--limit", type=whole_count, metavar="N", help="only N scenes of each")
    command.add_argument("--preset", choices=("mini",), default="mini", help="(default: mini)")
    command.add_argument("--weights", type=Path, metavar="PATH", help="(default: the shipped ones)")
    _add_backend(command)


def _add_folder(command: argparse.ArgumentParser) -> None:
    command.add_argument("folder", type=Path, metavar="FOLDER", help="in the layout that train photos writes")
    _add_description(command)


def _add_description(command: argparse.ArgumentParser) -> None:
    """What a folder of photos may not say of itself."""
    command.add_argument(
        "--crop",
        type=crop,
        metavar="LEFT,TOP,RIGHT,BOTTOM",
        help="part of every photo that counts, in pixels",
    )
    command.add_argument(
        "--intrinsics", type=intrinsics, metavar="FX,FY,CX,CY", help="in pixels of the photos before the crop"
    )
    command.add_argument(
        "--depth-unit", type=above_zero, metavar="METRES", help="a step of the depth maps (16 bits: 0.001)"
    )


def _add_choice(command: argparse.ArgumentParser, limit: str) -> None:
    """Which photos of a folder."""
    command.add_argument(
        "--part",
        choices=("all", "train", "validation"),
        default="all",
        help="runs of numbers that training sees, or those kept from it (default: all)",
    )
    command.add_argument("--only", type=numbers, metavar="N-M,...", help="only photos of these numbers")
    command.add_argument("--limit", type=whole_count, metavar="N", help=f"only N {limit}")


def _add_judging(command: argparse.ArgumentParser, presets: tuple[str, ...] = ("mini",)) -> None:
    command.add_argument("--preset", choices=presets, default="mini", help="(default: mini)")
    command.add_argument("--weights", type=Path, metavar="PATH", help="(default: the shipped ones)")
    command.add_argument(
        "--size", type=pixel_side, metavar="PX", help="the network sees about PX x PX pixels (default: 224)"
    )
    _add_backend(command)
    command.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="also write the tables as .md (default: print them)"
    )
    _add_json(command)


def _add_photo_sets(command: argparse.ArgumentParser) -> None:
    """Labelled photos beside rooms."""
    command.add_argument(
        "--photos",
        type=Path,
        dest="folder",
        metavar="FOLDER",
        help="also on the validation part of a folder of labelled photos",
    )
    _add_description(command)
    command.add_argument("--only", type=numbers, metavar="N-M,...", help="only photos of these numbers")
    _add_backend(command)


def _add_start(command: argparse.ArgumentParser, presets: tuple[str, ...] = ("mini",)) -> None:
    command.add_argument("--preset", choices=presets, default="mini", help="(default: mini)")
    command.add_argument(
        "--start",
        type=Path,
        metavar="PATH",
        help="weights to begin with; their encoder stays as it is (default: the shipped ones)",
    )


def _add_weights(commands) -> None:
    actions = _actions(commands, "weights", "the checkpoints this installation holds, and published ones")
    listing = _command(actions, "list", "name, size and origin of each checkpoint, and what can be had")
    _add_json(listing)
    get = _command(
        actions, "get", "download a published checkpoint and convert it; continues where it stopped"
    )
    get.add_argument("name", metavar="NAME", help="as `langflash weights list` has it")
    get.add_argument("--url", metavar="URL", help="fetch it from there instead")
    get.add_argument("--keep", action="store_true", help="keep the file as it was downloaded")
    _add_json(get)
    imported = _command(actions, "import", "convert a published checkpoint that is already here")
    imported.add_argument("path", type=Path, metavar="PATH", help=".ckpt, .pt or .safetensors")
    imported.add_argument("--preset", choices=("full",), default="full", help="(default: full)")
    imported.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="(default: in the cache folder, where it is found)"
    )
    imported.add_argument(
        "--size",
        type=pixel_side,
        metavar="PX",
        help="it was trained on photos of PX x PX (default: as its published name tells)",
    )
    _add_json(imported)
    verify = _command(actions, "verify", "read every number and check that it fits its network")
    verify.add_argument(
        "paths", nargs="*", type=Path, metavar="PATH", help="checkpoints (default: the shipped ones)"
    )
    _add_json(verify)


def _add_camera(command: argparse.ArgumentParser) -> None:
    camera = command.add_mutually_exclusive_group()
    camera.add_argument("--view", type=view_index, metavar="N", help="that photo's pose, from 0 (default: 0)")
    camera.add_argument(
        "--camera", type=Path, metavar="FILE", help="JSON with viewmat (4 x 4), K (3 x 3), width and height"
    )
    command.add_argument(
        "--size", type=size, metavar="WxH", help="pixels to draw (default: as the network saw it)"
    )


def _add_fade(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--fade", action="store_true", help="leave out what no photo looked at from about there, softly"
    )


def _add_backend(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--backend",
        choices=("gl", "torch"),
        help="gl: the window's renderer; torch: the slow reference (default: gl if there is OpenGL)",
    )


def _add_json(command: argparse.ArgumentParser) -> None:
    command.add_argument("--json", action="store_true", help="one JSON document on stdout, nothing else")
