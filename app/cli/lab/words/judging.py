"""The words of what says how good everything is, and how fast the network."""

import argparse

from ...values import above_zero, pixel_side, seed, whole_count
from ...words.shared import (
    add_backend,
    add_description,
    add_device,
    add_json,
    add_output,
    add_switch,
    new_actions,
    new_command,
)
from .common import (
    add_apart,
    add_cache,
    add_checkpoint,
    add_count,
    add_folder,
    add_judging,
    add_lpips,
    add_only,
    add_pack,
    add_path,
    add_posed,
    add_tables,
)
from .training import add_label_models

LAYOUT = "in the layout that train photos writes"
# langflash_core.lab.evaluation.protocols.PROTOCOLS, and photos one by one.
EVAL_PROTOCOLS = ("scannet", "3dovs", "re10k", "7scenes", "nyu")


def add_bench_network(commands) -> None:
    """`langflash bench network`."""
    command = new_command(commands, "bench-network", "measure how long each stage of the network takes")
    command.add_argument("--preset", choices=("mini", "full"), default="full", help="(default: full)")
    weights = command.add_mutually_exclusive_group()
    add_path(weights, "--weights", "PATH", "(default: the shipped or imported ones)")
    add_switch(weights, "--random", "draw them: the times are the same")
    command.add_argument(
        "--views", type=whole_count, nargs="+", default=[2], metavar="V", help="(default: 2)"
    )
    command.add_argument(
        "--atoms", type=whole_count, nargs="+", default=[128], metavar="K", help="(default: 128)"
    )
    add_count(command, "--repeats", "the median counts (default: 3)", 3)
    command.add_argument("--size", type=pixel_side, metavar="PX", help="(default: 224; full: 256)")
    add_switch(command, "--float32", "leave bfloat16 out, which is slow where a CPU lacks it")
    add_switch(command, "--compile", "through torch.compile")
    add_device(command)
    add_tables(command, "the numbers as .json")


def add_eval(commands) -> None:
    """`langflash lab eval`."""
    actions = new_actions(commands, "eval", "judge how good a checkpoint is on rooms that it has never seen")
    rooms = new_command(
        actions, "rooms", "geometry, pictures, labels and phrases, with trivial answers beside"
    )
    add_tables(rooms, "the tables as .md (default: only print them)")
    calibrate = new_command(actions, "calibrate", "presence threshold, as JSON for train export --metadata")
    _add_photo_sets(calibrate)
    add_path(calibrate, "--plot", "IMG", "also write the reliability diagram as .png")
    ablations = new_command(
        actions, "ablations", "which part of the method pays: groupings, vectors, K, rivals, stage times"
    )
    add_output(ablations, "FILE", "also write the tables as .md", required=False)
    add_path(ablations, "--work", "DIR", "keep what is judged there, and go on from it")
    add_json(ablations)
    for command in (rooms, calibrate, ablations):
        add_cache(command)
        add_checkpoint(command)
        add_count(command, "--limit", "only the first N scenes")
    _add_labelled(actions)
    _add_posed(actions)
    _add_sides(actions)
    _add_sharp(actions)
    _add_walk(actions)
    _add_beside(actions)
    _add_real(actions)
    _add_phrases(actions)
    _add_level(actions)
    _add_moved(actions)
    _add_labels(actions)
    _add_protocol(actions)
    _add_report(actions)
    photos = new_command(actions, "photos", "a sheet to judge by eye: pairs of photos, new views, heat-maps")
    add_path(photos, "photos", "PHOTO", "first and second in turn", nargs="+")
    add_output(photos, "IMG", "the .png to write")
    add_path(photos, "--weights", "PATH", "(default: the shipped ones)")
    photos.add_argument("--prompt", nargs="+", metavar="PHRASE", help="(default: ten things of a home)")


def _add_labelled(actions) -> None:
    command = new_command(
        actions, "photos-labelled", "names, presence and depth on single real photos that somebody labelled"
    )
    add_folder(command, LAYOUT)
    _add_choice(command, "photos, taken evenly (default: all)")
    add_judging(command)
    leads = new_command(actions, "leads", "what phrases of each kind start with, of labelled photos")
    add_folder(leads, LAYOUT)
    _add_choice(leads, "photos, taken evenly (default: all)")
    add_path(leads, "--weights", "PATH", "(default: the shipped ones)")
    add_backend(leads)
    add_output(leads, "FILE", "the .safetensors to write")
    leads.set_defaults(preset="mini")
    grouping = new_command(
        actions,
        "grouping",
        "groups and parts of single real photos against what was named or outlined in them",
    )
    add_folder(grouping, LAYOUT)
    _add_choice(grouping, "photos, taken evenly (default: all)")
    add_checkpoint(grouping)
    add_tables(grouping)


def _add_posed(actions) -> None:
    command = new_command(actions, "posed", "poses, depth and new views on real photos of known poses")
    add_folder(command, LAYOUT)
    add_apart(command)
    add_count(command, "--limit", "so many pairs (default: 40)")
    _add_fitting(command)
    add_judging(command)


def _add_labels(actions) -> None:
    command = new_command(
        actions, "labels", "labels as `langflash lab labels` makes them, of clips through rendered rooms"
    )
    add_pack(command)
    command.add_argument(
        "--seed", type=seed, nargs="+", default=[19], metavar="N", help="rooms (default: 19)"
    )
    add_path(command, "--results", "DIR", "also keep labels and report.html of every clip")
    add_label_models(command)
    add_path(command, "-o", "FILE", "also write the table as .md", dest="output")
    add_json(command)


def _add_sides(actions) -> None:
    command = new_command(actions, "sides", "scenes seen from aside: sheets, holes, layers, pictures")
    add_path(command, "pack", "PACK", "rooms, drawn with this furniture", nargs="?")
    add_posed(command)
    _add_room_set(command)
    add_apart(command)
    add_count(command, "--limit", "rooms or pairs (default: 100 or 40)")
    add_lpips(command)
    add_path(command, "--results", "DIR", "also keep every scene's numbers, for beside")
    add_judging(command)


def _add_sharp(actions) -> None:
    command = new_command(actions, "sharp", "pictures at the photos' size: PSNR, detail, lattice, opacity")
    purpose = "first and second in turn, or a folder of NAME_left, NAME_right (default: those shipped)"
    add_path(command, "photos", "PHOTO", purpose, nargs="*")
    add_posed(command)
    add_apart(command)
    add_path(command, "--pack", "PACK", "instead, rooms with this furniture")
    _add_room_set(command)
    add_count(command, "--limit", "pairs, triples (20) or rooms (20)")
    command.add_argument(
        "--detail",
        nargs="+",
        choices=("low", "normal", "high"),
        help="scenes made so, beside plain ones, one Gaussian a pixel (default: normal)",
    )
    add_path(command, "--beside", "FOLDER", "also scenes of another version, NAME.langflash")
    add_path(command, "--keep", "FOLDER", "write the scenes made, FOLDER/WAY/NAME.langflash")
    add_lpips(command)
    add_path(command, "--results", "DIR", "also keep every scene's numbers")
    add_judging(command)


def _add_level(actions) -> None:
    command = new_command(
        actions, "level", "how level scenes of rooms stand, their size, and what inventory and plan get right"
    )
    add_pack(command)
    add_count(command, "--limit", "so many rooms (default: 100)")
    add_count(command, "--photos", "of each room (default: 2)", 2)
    add_path(command, "--keep", "FOLDER", "scenes that are made stay there and are read again")
    add_switch(command, "--no-things", "leave inventory and plan out")
    add_tables(command)


def _add_moved(actions) -> None:
    command = new_command(actions, "moved", "what is found of things that were moved between two scenes")
    add_pack(command)
    add_count(command, "--limit", "so many rooms (default: 10)")
    add_path(command, "--keep", "FOLDER", "scenes that are made stay there and are read again")
    add_backend(command)
    add_tables(command)


def _add_walk(actions) -> None:
    command = new_command(
        actions, "walk", "the same place in 2, 4, 8 ... photos: cameras, depth, pictures between, size, time"
    )
    add_path(command, "pack", "PACK", "rooms, with this furniture", nargs="?")
    add_posed(command)
    _add_walked(command)
    _add_room_set(command)
    command.add_argument(
        "--exposure", type=above_zero, metavar="EV", help="each photo of a room is off by up to so many stops"
    )
    add_count(command, "--passers", "somebody stands in so many photos of a room")
    add_count(command, "--screens", "a screen shows another picture in so many photos")
    add_switch(command, "--assume-lens", "do not say which lens the photos have")
    add_switch(command, "--no-own", "leave out what a kept frame's own two photos bring alone")
    add_switch(command, "--memory", "each scene in a process of its own, whose memory is told")
    add_switch(command, "--colmap", "COLMAP's cameras beside; needs pycolmap")
    _add_fitting(command)
    purpose = "keep every walk there, for beside, and go on from it; one folder for each version"
    add_path(command, "--results", "DIR", purpose)
    add_path(command, "--sheet", "IMG", "also kept frames and scenes, as .png")
    add_judging(command)


def _add_beside(actions) -> None:
    command = new_command(actions, "beside", "two results of walk, or of sides, beside each other")
    add_path(command, "before", "BEFORE", "folder of --results")
    add_path(command, "after", "AFTER", "folder of --results")
    add_output(command, "FILE", "also write the table as .md", required=False)
    add_path(command, "--sheet", "IMG", "also pictures of both, as .png")
    command.set_defaults(json=False)


def _add_real(actions) -> None:
    command = new_command(
        actions,
        "real",
        "real frames of a place, without poses: how much of them and of others a scene shows",
    )
    add_path(command, "frames", "FRAMES", "a folder of frames in order, or a film")
    add_count(command, "--photos", "of a scene (default: 4 8 16, if so many)", nargs="+")
    add_switch(command, "--fused", "judge the one surface that splat files get")
    add_switch(command, "--no-own", "leave out what fewer photos bring alone")
    add_lpips(command)
    add_path(command, "--sheet", "IMG", "also frames and scenes, as .png")
    add_judging(command)


def _add_phrases(actions) -> None:
    command = new_command(
        actions, "phrases", "phrases as people ask them of a real place, against outlines made by hand"
    )
    add_path(command, "frames", "FRAMES", "a folder of the place's frames")
    add_path(command, "place", "PLACE", "what stands where in them: langflash_core/lab/evaluation/asked")
    add_count(command, "--photos", "of the scene, beside the frames asked (default: 8)")
    add_path(command, "--sheet", "IMG", "also what each phrase lights, as .png")
    add_judging(command)


def _add_walked(command: argparse.ArgumentParser) -> None:
    """Which frames of a walk are photos, and which are kept."""
    add_count(command, "--photos", "of a scene (default: 2 4 8 16 32)", nargs="+")
    add_switch(command, "--growing", "more photos go farther, instead of nearer together")
    add_count(command, "--step", "of --posed: every N-th photo (default: 1)", 1)
    add_count(command, "--kept", "frames kept from scenes (default: 8)")
    add_count(command, "--limit", "walks (default: 20 rooms, or 4 stretches)")


def _add_room_set(command: argparse.ArgumentParser) -> None:
    """Which rooms are made again."""
    command.add_argument(
        "--set", choices=("held_out", "validation"), default="held_out", help="of rooms (default: held_out)"
    )


def _add_protocol(actions) -> None:
    command = new_command(
        actions, "protocol", "a published data set where it lies, judged as papers judge it"
    )
    command.add_argument("name", choices=EVAL_PROTOCOLS, metavar="NAME", help=", ".join(EVAL_PROTOCOLS))
    add_path(command, "folder", "FOLDER", "as unpacked; nyu: also its .mat")
    add_path(command, "--index", "FILE", "re10k: which views, as pixelSplat's evaluation index")
    add_count(command, "--limit", "only the first N cases")
    _add_fitting(command)
    add_path(command, "--work", "DIR", "keep what is judged there, and go on from it")
    add_judging(command, ("mini", "full"))


def _add_fitting(command: argparse.ArgumentParser) -> None:
    """How pictures of kept back views are judged."""
    add_lpips(command)
    add_switch(command, "--align", "also from poses fitted to the photos, as NoPoSplat judges")


def _add_report(actions) -> None:
    command = new_command(actions, "report", "one page of everything at hand, with intervals and pictures")
    purpose = "folder for report.html, .md, .json, .csv; a run that was ended goes on from its work/"
    add_output(command, "DIR", purpose)
    add_path(command, "--rooms", "CACHE", "made by train cache: its held_out")
    add_path(command, "--pack", "PACK", "furniture: rooms are seen from aside, too")
    add_path(command, "--posed", "FOLDER", "real photos of known poses")
    add_path(command, "--photos", "FOLDER", "real photos with labels")
    command.add_argument(
        "--part", choices=("all", "train", "validation"), default="all", help="of --photos (default: all)"
    )
    add_description(command)
    add_path(command, "--scene", "S", "drawn in every way, as bench does")
    add_path(command, "--small", "DIR", "also the numbers and plots alone, for keeping")
    add_lpips(command)
    add_count(command, "--limit", "only N scenes of each")
    add_checkpoint(command)
    add_backend(command)


def _add_choice(command: argparse.ArgumentParser, limit: str) -> None:
    """Which photos of a folder."""
    command.add_argument(
        "--part",
        choices=("all", "train", "validation"),
        default="all",
        help="runs of numbers that training sees, or those kept from it (default: all)",
    )
    add_only(command)
    add_count(command, "--limit", f"only N {limit}")


def _add_photo_sets(command: argparse.ArgumentParser) -> None:
    """Labelled photos beside rooms."""
    add_folder(command, "also on the validation part of a folder of labelled photos", name="--photos")
    add_only(command)
    add_backend(command)
