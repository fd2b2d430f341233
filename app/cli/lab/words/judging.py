"""The words of what says how good everything is, and how fast the network."""

import argparse
from pathlib import Path

from ...values import above_zero, numbers, pixel_side, seed, whole_count
from ...words.shared import add_backend, add_description, add_json, add_output, new_actions, new_command
from .training import add_label_models

# langflash_core.lab.evaluation.protocols.PROTOCOLS, and photos one by one.
EVAL_PROTOCOLS = ("scannet", "3dovs", "re10k", "7scenes", "nyu")


def add_bench_network(commands) -> None:
    """`langflash bench network`."""
    command = new_command(commands, "bench-network", "measure how long each stage of the network takes")
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
    add_json(command)


def add_eval(commands) -> None:
    """`langflash lab eval`."""
    actions = new_actions(commands, "eval", "judge how good a checkpoint is on rooms that it has never seen")
    rooms = new_command(
        actions, "rooms", "geometry, pictures, labels and phrases, with trivial answers beside"
    )
    rooms.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="also write the tables as .md (default: only print them)",
    )
    add_json(rooms)
    calibrate = new_command(actions, "calibrate", "presence threshold, as JSON for train export --metadata")
    _add_photo_sets(calibrate)
    calibrate.add_argument(
        "--plot", type=Path, metavar="IMG", help="also write the reliability diagram as .png"
    )
    ablations = new_command(
        actions, "ablations", "which part of the method pays: groupings, vectors, K, rivals, stage times"
    )
    ablations.add_argument("-o", "--output", type=Path, metavar="FILE", help="also write the tables as .md")
    ablations.add_argument(
        "--work", type=Path, metavar="DIR", help="keep what is judged there, and go on from it"
    )
    add_json(ablations)
    for command in (rooms, calibrate, ablations):
        command.add_argument("cache", type=Path, metavar="CACHE", help="made by train cache")
        command.add_argument("--preset", choices=("mini",), default="mini", help="(default: mini)")
        command.add_argument("--weights", type=Path, metavar="PATH", help="(default: the shipped ones)")
        command.add_argument("--limit", type=whole_count, metavar="N", help="only the first N scenes")
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
    photos.add_argument("photos", nargs="+", type=Path, metavar="PHOTO", help="first and second in turn")
    add_output(photos, "IMG", "the .png to write")
    photos.add_argument("--weights", type=Path, metavar="PATH", help="(default: the shipped ones)")
    photos.add_argument("--prompt", nargs="+", metavar="PHRASE", help="(default: ten things of a home)")


def _add_labelled(actions) -> None:
    command = new_command(
        actions, "photos-labelled", "names, presence and depth on single real photos that somebody labelled"
    )
    _add_folder(command)
    _add_choice(command, "photos, taken evenly (default: all)")
    _add_judging(command)
    leads = new_command(actions, "leads", "what phrases of each kind start with, of labelled photos")
    _add_folder(leads)
    _add_choice(leads, "photos, taken evenly (default: all)")
    leads.add_argument("--weights", type=Path, metavar="PATH", help="(default: the shipped ones)")
    add_backend(leads)
    add_output(leads, "FILE", "the .safetensors to write")
    grouping = new_command(
        actions,
        "grouping",
        "groups and parts of single real photos against what was named or outlined in them",
    )
    _add_folder(grouping)
    _add_choice(grouping, "photos, taken evenly (default: all)")
    grouping.add_argument("--preset", choices=("mini",), default="mini", help="(default: mini)")
    grouping.add_argument("--weights", type=Path, metavar="PATH", help="(default: the shipped ones)")
    grouping.add_argument("-o", "--output", type=Path, metavar="FILE", help="also write the table as .md")
    add_json(grouping)


def _add_posed(actions) -> None:
    command = new_command(actions, "posed", "poses, depth and new views on real photos of known poses")
    _add_folder(command)
    command.add_argument(
        "--apart", type=whole_count, nargs="+", metavar="N", help="numbers between two (default: 6 12 18 24)"
    )
    command.add_argument("--limit", type=whole_count, metavar="N", help="so many pairs (default: 40)")
    _add_fitting(command)
    _add_judging(command)


def _add_labels(actions) -> None:
    command = new_command(
        actions, "labels", "labels as `langflash lab labels` makes them, of clips through rendered rooms"
    )
    command.add_argument("pack", type=Path, metavar="PACK", help="furniture, made by rooms pack")
    command.add_argument(
        "--seed", type=seed, nargs="+", default=[19], metavar="N", help="rooms (default: 19)"
    )
    command.add_argument(
        "--results", type=Path, metavar="DIR", help="also keep labels and report.html of every clip"
    )
    add_label_models(command)
    command.add_argument("-o", dest="output", type=Path, metavar="FILE", help="also write the table as .md")
    add_json(command)


def _add_sides(actions) -> None:
    command = new_command(actions, "sides", "scenes seen from aside: sheets, holes, layers, pictures")
    command.add_argument(
        "pack", type=Path, nargs="?", metavar="PACK", help="rooms, drawn with this furniture"
    )
    command.add_argument(
        "--posed", type=Path, dest="folder", metavar="FOLDER", help="instead, real photos of known poses"
    )
    add_description(command)
    _add_room_set(command)
    command.add_argument(
        "--apart", type=whole_count, nargs="+", metavar="N", help="numbers between two (default: 6 12 18 24)"
    )
    command.add_argument("--limit", type=whole_count, metavar="N", help="rooms or pairs (default: 100 or 40)")
    command.add_argument("--lpips", type=Path, metavar="FILE", help="LPIPS weights of VGG-16, .safetensors")
    command.add_argument(
        "--results", type=Path, metavar="DIR", help="also keep every scene's numbers, for beside"
    )
    _add_judging(command)


def _add_sharp(actions) -> None:
    command = new_command(actions, "sharp", "pictures at the photos' size: PSNR, detail, lattice, opacity")
    command.add_argument(
        "photos",
        nargs="*",
        type=Path,
        metavar="PHOTO",
        help="first and second in turn, or a folder of NAME_left, NAME_right (default: those shipped)",
    )
    command.add_argument(
        "--posed", type=Path, dest="folder", metavar="FOLDER", help="instead, real photos of known poses"
    )
    add_description(command)
    command.add_argument(
        "--apart", type=whole_count, nargs="+", metavar="N", help="numbers between two (default: 6 12 18 24)"
    )
    command.add_argument("--pack", type=Path, metavar="PACK", help="instead, rooms with this furniture")
    _add_room_set(command)
    command.add_argument("--limit", type=whole_count, metavar="N", help="pairs, triples (20) or rooms (20)")
    command.add_argument(
        "--detail",
        nargs="+",
        choices=("low", "normal", "high"),
        help="scenes made so, beside plain ones, one Gaussian a pixel (default: normal)",
    )
    command.add_argument(
        "--beside", type=Path, metavar="FOLDER", help="also scenes of another version, NAME.langflash"
    )
    command.add_argument(
        "--keep", type=Path, metavar="FOLDER", help="write the scenes made, FOLDER/WAY/NAME.langflash"
    )
    command.add_argument("--lpips", type=Path, metavar="FILE", help="LPIPS weights of VGG-16, .safetensors")
    command.add_argument("--results", type=Path, metavar="DIR", help="also keep every scene's numbers")
    _add_judging(command)


def _add_level(actions) -> None:
    command = new_command(
        actions, "level", "how level scenes of rooms stand, their size, and what inventory and plan get right"
    )
    command.add_argument("pack", type=Path, metavar="PACK", help="furniture, made by rooms pack")
    command.add_argument("--limit", type=whole_count, metavar="N", help="so many rooms (default: 100)")
    command.add_argument(
        "--photos", type=whole_count, default=2, metavar="N", help="of each room (default: 2)"
    )
    command.add_argument(
        "--keep", type=Path, metavar="FOLDER", help="scenes that are made stay there and are read again"
    )
    command.add_argument("--no-things", action="store_true", help="leave inventory and plan out")
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="also write the table as .md")
    add_json(command)


def _add_moved(actions) -> None:
    command = new_command(actions, "moved", "what is found of things that were moved between two scenes")
    command.add_argument("pack", type=Path, metavar="PACK", help="furniture, made by rooms pack")
    command.add_argument("--limit", type=whole_count, metavar="N", help="so many rooms (default: 10)")
    command.add_argument(
        "--keep", type=Path, metavar="FOLDER", help="scenes that are made stay there and are read again"
    )
    add_backend(command)
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="also write the table as .md")
    add_json(command)


def _add_walk(actions) -> None:
    command = new_command(
        actions, "walk", "the same place in 2, 4, 8 ... photos: cameras, depth, pictures between, size, time"
    )
    command.add_argument("pack", type=Path, nargs="?", metavar="PACK", help="rooms, with this furniture")
    command.add_argument(
        "--posed", type=Path, dest="folder", metavar="FOLDER", help="instead, real photos of known poses"
    )
    add_description(command)
    _add_walked(command)
    _add_room_set(command)
    command.add_argument(
        "--exposure", type=above_zero, metavar="EV", help="each photo of a room is off by up to so many stops"
    )
    command.add_argument(
        "--passers", type=whole_count, metavar="N", help="somebody stands in so many photos of a room"
    )
    command.add_argument(
        "--screens", type=whole_count, metavar="N", help="a screen shows another picture in so many photos"
    )
    command.add_argument("--assume-lens", action="store_true", help="do not say which lens the photos have")
    command.add_argument(
        "--no-own", action="store_true", help="leave out what a kept frame's own two photos bring alone"
    )
    command.add_argument(
        "--memory", action="store_true", help="each scene in a process of its own, whose memory is told"
    )
    command.add_argument("--colmap", action="store_true", help="COLMAP's cameras beside; needs pycolmap")
    _add_fitting(command)
    command.add_argument(
        "--results",
        type=Path,
        metavar="DIR",
        help="keep every walk there, for beside, and go on from it; one folder for each version",
    )
    command.add_argument("--sheet", type=Path, metavar="IMG", help="also kept frames and scenes, as .png")
    _add_judging(command)


def _add_beside(actions) -> None:
    command = new_command(actions, "beside", "two results of walk, or of sides, beside each other")
    command.add_argument("before", type=Path, metavar="BEFORE", help="folder of --results")
    command.add_argument("after", type=Path, metavar="AFTER", help="folder of --results")
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="also write the table as .md")
    command.add_argument("--sheet", type=Path, metavar="IMG", help="also pictures of both, as .png")
    command.set_defaults(json=False)


def _add_real(actions) -> None:
    command = new_command(
        actions,
        "real",
        "real frames of a place, without poses: how much of them and of others a scene shows",
    )
    command.add_argument("frames", type=Path, metavar="FRAMES", help="a folder of frames in order, or a film")
    command.add_argument(
        "--photos", type=whole_count, nargs="+", metavar="N", help="of a scene (default: 4 8 16, if so many)"
    )
    command.add_argument("--fused", action="store_true", help="judge the one surface that splat files get")
    command.add_argument("--no-own", action="store_true", help="leave out what fewer photos bring alone")
    command.add_argument("--lpips", type=Path, metavar="FILE", help="LPIPS weights of VGG-16, .safetensors")
    command.add_argument("--sheet", type=Path, metavar="IMG", help="also frames and scenes, as .png")
    _add_judging(command)


def _add_phrases(actions) -> None:
    command = new_command(
        actions, "phrases", "phrases as people ask them of a real place, against outlines made by hand"
    )
    command.add_argument("frames", type=Path, metavar="FRAMES", help="a folder of the place's frames")
    command.add_argument(
        "place",
        type=Path,
        metavar="PLACE",
        help="what stands where in them: langflash_core/lab/evaluation/asked",
    )
    command.add_argument(
        "--photos", type=whole_count, metavar="N", help="of the scene, beside the frames asked (default: 8)"
    )
    command.add_argument("--sheet", type=Path, metavar="IMG", help="also what each phrase lights, as .png")
    _add_judging(command)


def _add_walked(command: argparse.ArgumentParser) -> None:
    """Which frames of a walk are photos, and which are kept."""
    command.add_argument(
        "--photos", type=whole_count, nargs="+", metavar="N", help="of a scene (default: 2 4 8 16 32)"
    )
    command.add_argument(
        "--growing", action="store_true", help="more photos go farther, instead of nearer together"
    )
    command.add_argument(
        "--step", type=whole_count, default=1, metavar="N", help="of --posed: every N-th photo (default: 1)"
    )
    command.add_argument("--kept", type=whole_count, metavar="N", help="frames kept from scenes (default: 8)")
    command.add_argument(
        "--limit", type=whole_count, metavar="N", help="walks (default: 20 rooms, or 4 stretches)"
    )


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
    command.add_argument("folder", type=Path, metavar="FOLDER", help="as unpacked; nyu: also its .mat")
    command.add_argument(
        "--index", type=Path, metavar="FILE", help="re10k: which views, as pixelSplat's evaluation index"
    )
    command.add_argument("--limit", type=whole_count, metavar="N", help="only the first N cases")
    _add_fitting(command)
    command.add_argument(
        "--work", type=Path, metavar="DIR", help="keep what is judged there, and go on from it"
    )
    _add_judging(command, ("mini", "full"))


def _add_fitting(command: argparse.ArgumentParser) -> None:
    """How pictures of kept back views are judged."""
    command.add_argument("--lpips", type=Path, metavar="FILE", help="LPIPS weights of VGG-16, .safetensors")
    command.add_argument(
        "--align", action="store_true", help="also from poses fitted to the photos, as NoPoSplat judges"
    )


def _add_report(actions) -> None:
    command = new_command(actions, "report", "one page of everything at hand, with intervals and pictures")
    command.add_argument(
        "-o", "--output", type=Path, required=True, metavar="DIR",
        help="folder for report.html, .md, .json, .csv; a run that was ended goes on from its work/",
    )  # fmt: skip
    command.add_argument("--rooms", type=Path, metavar="CACHE", help="made by train cache: its held_out")
    command.add_argument(
        "--pack", type=Path, metavar="PACK", help="furniture: rooms are seen from aside, too"
    )
    command.add_argument("--posed", type=Path, metavar="FOLDER", help="real photos of known poses")
    command.add_argument("--photos", type=Path, metavar="FOLDER", help="real photos with labels")
    command.add_argument(
        "--part", choices=("all", "train", "validation"), default="all", help="of --photos (default: all)"
    )
    add_description(command)
    command.add_argument("--scene", type=Path, metavar="S", help="drawn in every way, as bench does")
    command.add_argument(
        "--small", type=Path, metavar="DIR", help="also the numbers and plots alone, for keeping"
    )
    command.add_argument("--lpips", type=Path, metavar="FILE", help="LPIPS weights of VGG-16, .safetensors")
    command.add_argument("--limit", type=whole_count, metavar="N", help="only N scenes of each")
    command.add_argument("--preset", choices=("mini",), default="mini", help="(default: mini)")
    command.add_argument("--weights", type=Path, metavar="PATH", help="(default: the shipped ones)")
    add_backend(command)


def _add_folder(command: argparse.ArgumentParser) -> None:
    command.add_argument("folder", type=Path, metavar="FOLDER", help="in the layout that train photos writes")
    add_description(command)


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
    add_backend(command)
    command.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="also write the tables as .md (default: print them)"
    )
    add_json(command)


def _add_photo_sets(command: argparse.ArgumentParser) -> None:
    """Labelled photos beside rooms."""
    command.add_argument(
        "--photos",
        type=Path,
        dest="folder",
        metavar="FOLDER",
        help="also on the validation part of a folder of labelled photos",
    )
    add_description(command)
    command.add_argument("--only", type=numbers, metavar="N-M,...", help="only photos of these numbers")
    add_backend(command)
