"""The words of furnished rooms and of training on them and on photos."""

import argparse
from pathlib import Path

from langflash_core.network.presets import PRECISIONS

from ...values import above_zero, minutes, part, seed, share, size, whole_count
from ...words.shared import add_description, add_json, add_output, new_actions, new_command

# langflash_core.lab.photos.layouts.LAYOUTS, which would bring torch along.
LAYOUTS = (
    "nyu", "coco", "ade20k", "sunrgbd", "frames", "coco-things", "polygons", "plain", "panoramas",
)  # fmt: skip


def add_rooms(commands) -> None:
    """`langflash lab rooms`."""
    actions = new_actions(commands, "rooms", "make furnished rooms for training and tests")
    pack = new_command(actions, "pack", "furniture libraries (.sh3f) to one pack")
    pack.add_argument("folder", type=Path, metavar="FOLDER")
    add_output(pack, "PACK", "the pack to write")
    preview = new_command(actions, "preview", "a contact sheet of rooms")
    preview.add_argument("pack", type=Path, metavar="PACK")
    add_output(preview, "IMG", "the .png to write")
    _add_seeds(preview, count=9)
    render = new_command(actions, "render", "rooms with depth, instances and names, one .npz each")
    render.add_argument("pack", type=Path, metavar="PACK")
    add_output(render, "DIR", "folder to fill; rooms that are there are kept")
    _add_seeds(render, count=100)
    render.add_argument("--views", type=whole_count, default=2, metavar="V", help="(default: 2)")
    render.add_argument("--size", type=size, default=(224, 224), metavar="WxH", help="(default: 224x224)")


def _add_seeds(command: argparse.ArgumentParser, *, count: int) -> None:
    command.add_argument("--seed", type=seed, default=0, metavar="N", help="the first room (default: 0)")
    command.add_argument(
        "--count", type=whole_count, default=count, metavar="N", help=f"rooms (default: {count})"
    )
    command.add_argument("--held-out", action="store_true", help="furniture that training never sees")


def add_labels(commands) -> None:
    """`langflash lab labels`."""
    command = new_command(
        commands,
        "labels",
        "label what is where in every frame of a clip, to train on; what is done is not done again",
        epilog="The exit code is 0 when all clips are done, 1 when some failed (ledger.csv says why), "
        "2 for bad input, 130 after Ctrl-C.",
    )
    command.add_argument(
        "source",
        type=Path,
        metavar="CLIP|FOLDER",
        help="a folder of frames in order of their names (or images/ with K.txt and poses.txt), a folder of "
        "such folders, or a split of RealEstate10K in chunks (index.json)",
    )
    add_output(command, "OUT", "gets a folder a clip (labels and report.html), ledger.csv and summary.html")
    add_label_models(command)
    command.add_argument("--start", type=seed, default=0, metavar="N", help="the first frame (default: 0)")
    command.add_argument("--count", type=whole_count, metavar="N", help="at most so many frames of each clip")
    command.add_argument(
        "--step", type=whole_count, default=1, metavar="N", help="every so manyth frame (default: 1)"
    )
    command.add_argument(
        "--workers", type=whole_count, metavar="N", help="processes side by side (default: this one alone)"
    )
    command.add_argument(
        "--address", metavar="RAY", help="a Ray cluster instead of processes: host:port, auto, or local"
    )
    inside = command.add_mutually_exclusive_group()
    inside.add_argument(
        "--enrich", action="store_true", help="put labels into the split's chunks afterwards, in place"
    )
    inside.add_argument(
        "--extract", action="store_true", help="make no labels: take those in the split's chunks out to OUT"
    )
    command.add_argument("--device", choices=("cpu", "cuda"), default="cpu", help="(default: cpu)")
    add_json(command)


def add_label_models(command: argparse.ArgumentParser) -> None:
    """What `langflash lab labels` makes labels with."""
    command.add_argument(
        "--masks",
        choices=("network", "mobile-sam", "sam2"),
        default="network",
        help="who proposes and corrects masks (default: network, our own, which needs no weights)",
    )
    command.add_argument(
        "--weights",
        metavar="PATH",
        help="of --masks: mobile_sam.pt or a .safetensors of it; for sam2 a folder that transformers saved, "
        "or a name that it fetches",
    )
    command.add_argument(
        "--side",
        type=whole_count,
        default=1024,
        metavar="PX",
        help="the square that MobileSAM sees; 512 is four times as quick (default: 1024)",
    )
    command.add_argument(
        "--follow",
        choices=("flow", "network", "sam2"),
        default="flow",
        help="what carries objects from frame to frame: optical flow, our network's matches and depth, or "
        "SAM 2's memory (default: flow)",
    )
    command.add_argument(
        "--vectors",
        choices=("minilm", "clip"),
        default="minilm",
        help="the space of the objects' vectors: our network's names, or CLIP of cut-outs (default: minilm)",
    )


def add_train(commands) -> None:
    """`langflash lab train`."""
    actions = new_actions(commands, "train", "train the network on rendered rooms")
    adopt = new_command(actions, "adopt", "published weights of the frozen parts to a file to start from")
    adopt.add_argument("encoder", type=Path, metavar="ENCODER", help="timm state dict, .safetensors")
    adopt.add_argument("local", type=Path, metavar="XFEAT", help="XFeat's state dict, .safetensors")
    add_output(adopt, "FILE", "the .safetensors to write")
    adopt.add_argument("--preset", choices=("mini",), default="mini", help="(default: mini)")
    _add_cache(actions)
    _add_convert(actions)
    _add_outlines(actions)
    _add_opinions(actions)
    parts = new_command(actions, "parts", "find the parts of cached rooms, for the stage naming")
    parts.add_argument("cache", type=Path, metavar="CACHE", help="made by train cache")
    parts.add_argument(
        "--run", type=Path, metavar="RUN", help="folder of train run whose stages are used (default: none)"
    )
    parts.add_argument(
        "--part", type=part, default=(0, 1), metavar="I/N", help="the I-th of N processes, from 0"
    )
    _add_start(parts)
    _add_late(actions)
    _add_second(actions)
    _add_stages(actions)
    export = new_command(actions, "export", "all stages of a run to one checkpoint")
    export.add_argument("run", type=Path, metavar="RUN")
    add_output(export, "FILE", "the .safetensors to write")
    export.add_argument("--metadata", type=Path, metavar="JSON", help="an object to add to the model card")
    export.add_argument(
        "--named",
        type=share,
        default=1.0,
        metavar="SHARE",
        help="what the namer's corrections count of what it learned (default: 1)",
    )
    _add_start(export, presets=("mini", "full"))


def _add_cache(actions) -> None:
    cache = new_command(
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
    add_description(cache)
    cache.add_argument(
        "--copies",
        type=whole_count,
        default=1,
        metavar="N",
        help="views of each photo (default: 1, as it is)",
    )
    add_output(cache, "CACHE", "folder to fill")
    cache.add_argument("--set", choices=("train", "validation", "held_out"), default="train")
    cache.add_argument("--scenes", type=whole_count, default=4096, metavar="N", help="(default: 4096)")
    cache.add_argument(
        "--part", type=part, default=(0, 1), metavar="I/N", help="the I-th of N processes, from 0"
    )
    _add_start(cache, presets=("mini", "full"))


def _add_stages(actions) -> None:
    run = new_command(actions, "run", "train stages, one after the other; continues where a run stopped")
    run.add_argument("cache", type=Path, metavar="CACHE", help="made by train cache")
    add_output(run, "RUN", "folder of checkpoints and logs")
    run.add_argument("--stages", nargs="+", metavar="STAGE", help="such as depth refine gaussians")
    run.add_argument("--minutes", nargs="+", type=minutes, metavar="M", help="one per stage")
    run.add_argument(
        "--recipe", metavar="NAME", help="instead: stages with all their numbers, 'paper' or a .toml"
    )
    run.add_argument(
        "--scenes",
        type=Path,
        metavar="FOLDER",
        help="grouping and aggregation learn from this data set as it was unpacked, ScanNet or labelled "
        "chunks of RealEstate10K, or posed clips with --labels, instead of cached rooms",
    )
    run.add_argument(
        "--labels",
        type=Path,
        metavar="OUT",
        help="of --scenes: what langflash lab labels wrote of these clips",
    )
    run.add_argument(
        "--outlined",
        type=Path,
        nargs="+",
        default=[],
        metavar="FOLDER",
        help="photos from which grouping learns besides: outlined, as train outlines makes them, or named",
    )
    _add_loop(run)
    run.add_argument(
        "--sam-teacher",
        type=Path,
        metavar="FILE",
        help="weights of MobileSAM (mobile_sam.pt), whose embedding grouping regresses besides",
    )
    run.add_argument(
        "--from-scratch", action="store_true", help="draw the heads anew instead of going on with --start's"
    )
    _add_start(run, presets=("mini", "full"))


def _add_opinions(actions) -> None:
    command = new_command(
        actions,
        "opinions",
        "keep beside photos what another network says of them, for train late --more; what is done stays",
    )
    command.add_argument("folder", type=Path, metavar="FOLDER", help="photos, as train photos makes them")
    add_description(command)
    command.add_argument(
        "--weights",
        type=Path,
        required=True,
        metavar="FILE",
        help="the network, .tflite: scores of names a pixel",
    )
    command.add_argument(
        "--part", type=part, default=(0, 1), metavar="I/N", help="the I-th of N processes, from 0"
    )


def _add_outlines(actions) -> None:
    command = new_command(
        actions, "outlines", "outline what could be an object in photos without labels; what is done stays"
    )
    command.add_argument("folder", type=Path, metavar="FOLDER", help="photos, as train photos makes them")
    add_description(command)
    add_output(command, "OUT", "folder to fill: the photos, cropped, with maps of their objects")
    command.add_argument(
        "--weights", type=Path, required=True, metavar="FILE", help="of MobileSAM (mobile_sam.pt)"
    )
    command.add_argument(
        "--side",
        type=whole_count,
        default=512,
        metavar="PX",
        help="the square that MobileSAM sees (default: 512; 1024 takes four times as long)",
    )
    command.add_argument(
        "--grid", type=whole_count, default=12, metavar="N", help="points along the longer side (default: 12)"
    )
    command.add_argument("--device", choices=("cpu", "cuda"), default="cpu", help="(default: cpu)")
    command.add_argument(
        "--part", type=part, default=(0, 1), metavar="I/N", help="the I-th of N processes, from 0"
    )


def _add_late(actions) -> None:
    late = new_command(
        actions, "late", "train the late halves of the encoder, names and depth, on labelled photos and rooms"
    )
    _add_labelled(late)
    late.add_argument(
        "--more",
        type=Path,
        nargs="+",
        default=[],
        metavar="FOLDER",
        help="other photos, labelled, in part or not at all: learning goes on from what the weights have, "
        "and an average of the weights teaches what nobody labelled",
    )
    late.add_argument(
        "--names",
        action="store_true",
        help="with --more: names alone learn, depth stays as it is: a third more steps in the same time",
    )
    _add_budget(late)


def _add_second(actions) -> None:
    second = new_command(
        actions, "second", "train what reads other networks' maps, on labelled photos and rooms"
    )
    _add_labelled(second)
    second.add_argument(
        "--more", type=Path, nargs="+", default=[], metavar="FOLDER", help="other photos that name something"
    )
    second.add_argument(
        "--weights",
        type=Path,
        nargs=2,
        metavar=("DEEPLAB", "MOSAIC"),
        help="DeepLab of 150 names on MobileNetV2, MOSAIC R4: .tflite (default: those of the weights file)",
    )
    _add_budget(second)


def _add_labelled(command: argparse.ArgumentParser) -> None:
    command.add_argument("cache", type=Path, metavar="CACHE", help="rooms, made by train cache")
    command.add_argument(
        "--photos",
        type=Path,
        dest="folder",
        metavar="FOLDER",
        required=True,
        help="labelled photos, as train photos makes them; every seventh run of numbers is kept to validate",
    )
    add_description(command)


def _add_budget(command: argparse.ArgumentParser) -> None:
    add_output(command, "RUN", "folder of checkpoints and logs")
    command.add_argument("--minutes", required=True, type=minutes, metavar="M", help="of training")
    _add_loop(command)
    _add_start(command)


def _add_loop(command: argparse.ArgumentParser) -> None:
    """What every training loop can be told."""
    command.add_argument("--max-steps", type=whole_count, metavar="N", help="stop each stage earlier")
    command.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    command.add_argument("--seed", type=seed, default=0, metavar="N")
    command.add_argument(
        "--batches",
        type=whole_count,
        metavar="N",
        help="that a step is made of, shared by the processes (default: one each)",
    )
    command.add_argument(
        "--workers",
        type=seed,
        default=0,
        metavar="N",
        help="processes that read ahead, so that a graphics card waits for none (default: none)",
    )
    command.add_argument(
        "--rate", type=above_zero, metavar="R", help="the peak learning rate (default: the stage's)"
    )
    command.add_argument(
        "--pictures",
        type=whole_count,
        metavar="N",
        help="of a step, of each kind (default: the stage's)",
    )
    command.add_argument("--precision", choices=PRECISIONS, default="auto")
    command.add_argument("--board", action="store_true", help="also write TensorBoard's logs, in RUN/board")


def _add_convert(actions) -> None:
    command = new_command(actions, "photos", "a published data set to a folder of labelled photos")
    command.add_argument("layout", choices=LAYOUTS, metavar="LAYOUT", help=", ".join(LAYOUTS))
    command.add_argument("source", type=Path, metavar="SOURCE", help="the folder or file as downloaded")
    add_output(command, "FOLDER", "folder to fill; photos that are there are kept")
    command.add_argument(
        "--splits", type=Path, metavar="FILE", help="nyu: splits.mat, for its training split"
    )
    command.add_argument("--classes", type=Path, metavar="FILE", help="nyu: classMapping40.mat")
    command.add_argument(
        "--images", type=Path, metavar="FOLDER", help="of coco layouts: where the photos are"
    )
    command.add_argument("--camera", type=Path, metavar="FILE", help="frames: K, nine numbers")
    command.add_argument("--limit", type=whole_count, metavar="N", help="only the first N photos")


def _add_start(command: argparse.ArgumentParser, presets: tuple[str, ...] = ("mini",)) -> None:
    command.add_argument("--preset", choices=presets, default="mini", help="(default: mini)")
    command.add_argument(
        "--start",
        type=Path,
        metavar="PATH",
        help="weights to begin with; their encoder stays as it is (default: the shipped ones)",
    )
