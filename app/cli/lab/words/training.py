"""The words of furnished rooms and of training on them and on photos."""

import argparse

from langflash_core.network.presets import PRECISIONS

from ...values import above_zero, minutes, seed, share, size, whole_count
from ...words.shared import add_json, add_output, add_switch, new_actions, new_command
from .common import add_cache, add_count, add_folder, add_part, add_path, add_preset, add_processor

# langflash_core.lab.photos.layouts.LAYOUTS, which would bring torch along.
LAYOUTS = (
    "nyu", "coco", "ade20k", "sunrgbd", "frames", "coco-things", "polygons", "plain", "panoramas",
)  # fmt: skip


def add_rooms(commands) -> None:
    """`langflash lab rooms`."""
    actions = new_actions(commands, "rooms", "make furnished rooms for training and tests")
    pack = new_command(actions, "pack", "furniture libraries (.sh3f) to one pack")
    add_path(pack, "folder", "FOLDER")
    add_output(pack, "PACK", "the pack to write")
    preview = new_command(actions, "preview", "a contact sheet of rooms")
    add_path(preview, "pack", "PACK")
    add_output(preview, "IMG", "the .png to write")
    _add_seeds(preview, count=9)
    render = new_command(actions, "render", "rooms with depth, instances and names, one .npz each")
    add_path(render, "pack", "PACK")
    add_output(render, "DIR", "folder to fill; rooms that are there are kept")
    _add_seeds(render, count=100)
    render.add_argument("--views", type=whole_count, default=2, metavar="V", help="(default: 2)")
    render.add_argument("--size", type=size, default=(224, 224), metavar="WxH", help="(default: 224x224)")


def _add_seeds(command: argparse.ArgumentParser, *, count: int) -> None:
    command.add_argument("--seed", type=seed, default=0, metavar="N", help="the first room (default: 0)")
    add_count(command, "--count", f"rooms (default: {count})", count)
    add_switch(command, "--held-out", "furniture that training never sees")


def add_labels(commands) -> None:
    """`langflash lab labels`."""
    command = new_command(
        commands,
        "labels",
        "label what is where in every frame of a clip, to train on; what is done is not done again",
        epilog="The exit code is 0 when all clips are done, 1 when some failed (ledger.csv says why), "
        "2 for bad input, 130 after Ctrl-C.",
    )
    add_path(
        command,
        "source",
        "CLIP|FOLDER",
        "a folder of frames in order of their names (or images/ with K.txt and poses.txt), a folder of "
        "such folders, or a split of RealEstate10K in chunks (index.json)",
    )
    add_output(command, "OUT", "gets a folder a clip (labels and report.html), ledger.csv and summary.html")
    add_label_models(command)
    command.add_argument("--start", type=seed, default=0, metavar="N", help="the first frame (default: 0)")
    add_count(command, "--count", "at most so many frames of each clip")
    add_count(command, "--step", "every so manyth frame (default: 1)", 1)
    add_count(command, "--workers", "processes side by side (default: this one alone)")
    command.add_argument(
        "--address", metavar="RAY", help="a Ray cluster instead of processes: host:port, auto, or local"
    )
    inside = command.add_mutually_exclusive_group()
    add_switch(inside, "--enrich", "put labels into the split's chunks afterwards, in place")
    add_switch(inside, "--extract", "make no labels: take those in the split's chunks out to OUT")
    add_processor(command)
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
    add_path(adopt, "encoder", "ENCODER", "timm state dict, .safetensors")
    add_path(adopt, "local", "XFEAT", "XFeat's state dict, .safetensors")
    add_output(adopt, "FILE", "the .safetensors to write")
    add_preset(adopt)
    _add_cache(actions)
    _add_convert(actions)
    _add_outlines(actions)
    _add_opinions(actions)
    parts = new_command(actions, "parts", "find the parts of cached rooms, for the stage naming")
    add_cache(parts)
    add_path(parts, "--run", "RUN", "folder of train run whose stages are used (default: none)")
    add_part(parts)
    _add_start(parts)
    _add_late(actions)
    _add_second(actions)
    _add_stages(actions)
    export = new_command(actions, "export", "all stages of a run to one checkpoint")
    add_path(export, "run", "RUN")
    add_output(export, "FILE", "the .safetensors to write")
    add_path(export, "--metadata", "JSON", "an object to add to the model card")
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
    add_path(cache, "pack", "PACK", "made by rooms pack", nargs="?")
    purpose = "instead of rooms, a folder of labelled photos as train photos makes it"
    add_folder(cache, purpose, name="--photos")
    add_count(cache, "--copies", "views of each photo (default: 1, as it is)", 1)
    add_output(cache, "CACHE", "folder to fill")
    cache.add_argument("--set", choices=("train", "validation", "held_out"), default="train")
    add_count(cache, "--scenes", "(default: 4096)", 4096)
    add_part(cache)
    _add_start(cache, presets=("mini", "full"))


def _add_stages(actions) -> None:
    run = new_command(actions, "run", "train stages, one after the other; continues where a run stopped")
    add_cache(run)
    add_output(run, "RUN", "folder of checkpoints and logs")
    run.add_argument("--stages", nargs="+", metavar="STAGE", help="such as depth refine gaussians")
    run.add_argument("--minutes", nargs="+", type=minutes, metavar="M", help="one per stage")
    run.add_argument(
        "--recipe", metavar="NAME", help="instead: stages with all their numbers, 'paper' or a .toml"
    )
    add_path(
        run,
        "--scenes",
        "FOLDER",
        "grouping and aggregation learn from this data set as it was unpacked, ScanNet or labelled "
        "chunks of RealEstate10K, or posed clips with --labels, instead of cached rooms",
    )
    add_path(run, "--labels", "OUT", "of --scenes: what langflash lab labels wrote of these clips")
    add_path(
        run,
        "--outlined",
        "FOLDER",
        "photos from which grouping learns besides: outlined, as train outlines makes them, or named",
        nargs="+",
        default=[],
    )
    _add_loop(run)
    purpose = "weights of MobileSAM (mobile_sam.pt), whose embedding grouping regresses besides"
    add_path(run, "--sam-teacher", "FILE", purpose)
    add_switch(run, "--from-scratch", "draw the heads anew instead of going on with --start's")
    _add_start(run, presets=("mini", "full"))


def _add_opinions(actions) -> None:
    command = new_command(
        actions,
        "opinions",
        "keep beside photos what another network says of them, for train late --more; what is done stays",
    )
    add_folder(command, "photos, as train photos makes them")
    add_path(command, "--weights", "FILE", "the network, .tflite: scores of names a pixel", required=True)
    add_part(command)


def _add_outlines(actions) -> None:
    command = new_command(
        actions, "outlines", "outline what could be an object in photos without labels; what is done stays"
    )
    add_folder(command, "photos, as train photos makes them")
    add_output(command, "OUT", "folder to fill: the photos, cropped, with maps of their objects")
    add_path(command, "--weights", "FILE", "of MobileSAM (mobile_sam.pt)", required=True)
    command.add_argument(
        "--side",
        type=whole_count,
        default=512,
        metavar="PX",
        help="the square that MobileSAM sees (default: 512; 1024 takes four times as long)",
    )
    add_count(command, "--grid", "points along the longer side (default: 12)", 12)
    add_processor(command)
    add_part(command)


def _add_late(actions) -> None:
    late = new_command(
        actions, "late", "train the late halves of the encoder, names and depth, on labelled photos and rooms"
    )
    _add_labelled(late)
    add_path(
        late,
        "--more",
        "FOLDER",
        "other photos, labelled, in part or not at all: learning goes on from what the weights have, "
        "and an average of the weights teaches what nobody labelled",
        nargs="+",
        default=[],
    )
    purpose = "with --more: names alone learn, depth stays as it is: a third more steps in the same time"
    add_switch(late, "--names", purpose)
    _add_budget(late)


def _add_second(actions) -> None:
    second = new_command(
        actions, "second", "train what reads other networks' maps, on labelled photos and rooms"
    )
    _add_labelled(second)
    add_path(second, "--more", "FOLDER", "other photos that name something", nargs="+", default=[])
    add_path(
        second,
        "--weights",
        ("DEEPLAB", "MOSAIC"),
        "DeepLab of 150 names on MobileNetV2, MOSAIC R4: .tflite (default: those of the weights file)",
        nargs=2,
    )
    _add_budget(second)


def _add_labelled(command: argparse.ArgumentParser) -> None:
    add_cache(command, "rooms, made by train cache")
    purpose = "labelled photos, as train photos makes them; every seventh run of numbers is kept to validate"
    add_folder(command, purpose, name="--photos", required=True)


def _add_budget(command: argparse.ArgumentParser) -> None:
    add_output(command, "RUN", "folder of checkpoints and logs")
    command.add_argument("--minutes", required=True, type=minutes, metavar="M", help="of training")
    _add_loop(command)
    _add_start(command)


def _add_loop(command: argparse.ArgumentParser) -> None:
    """What every training loop can be told."""
    add_count(command, "--max-steps", "stop each stage earlier")
    command.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    command.add_argument("--seed", type=seed, default=0, metavar="N")
    add_count(command, "--batches", "that a step is made of, shared by the processes (default: one each)")
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
    add_count(command, "--pictures", "of a step, of each kind (default: the stage's)")
    command.add_argument("--precision", choices=PRECISIONS, default="auto")
    add_switch(command, "--board", "also write TensorBoard's logs, in RUN/board")


def _add_convert(actions) -> None:
    command = new_command(actions, "photos", "a published data set to a folder of labelled photos")
    command.add_argument("layout", choices=LAYOUTS, metavar="LAYOUT", help=", ".join(LAYOUTS))
    add_path(command, "source", "SOURCE", "the folder or file as downloaded")
    add_output(command, "FOLDER", "folder to fill; photos that are there are kept")
    add_path(command, "--splits", "FILE", "nyu: splits.mat, for its training split")
    add_path(command, "--classes", "FILE", "nyu: classMapping40.mat")
    add_path(command, "--images", "FOLDER", "of coco layouts: where the photos are")
    add_path(command, "--camera", "FILE", "frames: K, nine numbers")
    add_count(command, "--limit", "only the first N photos")


def _add_start(command: argparse.ArgumentParser, presets: tuple[str, ...] = ("mini",)) -> None:
    add_preset(command, presets)
    purpose = "weights to begin with; their encoder stays as it is (default: the shipped ones)"
    add_path(command, "--start", "PATH", purpose)
