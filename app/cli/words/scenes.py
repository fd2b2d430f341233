"""The words of making, asking, drawing and exporting scenes, and of weights."""

from pathlib import Path

from langflash_core.base import pictures
from langflash_core.base.detail import EXPORT_DETAILS
from langflash_core.base.outputs import WORDS, help_of_files, help_of_words
from langflash_core.mending.recipes import HOWS, KINDS
from langflash_core.network.presets import AGGREGATIONS, GROUPINGS, PRECISIONS

from ..values import (
    above_zero,
    film_seconds,
    frame_count,
    intrinsics,
    kept_fraction,
    open_fov,
    pixel_side,
    share,
    spot,
    what,
    whole_count,
)
from .shared import (
    add_axes,
    add_backend,
    add_camera,
    add_colours,
    add_detail,
    add_film_part,
    add_json,
    add_network,
    add_output,
    add_shown,
    new_actions,
    new_command,
)


def add_view(commands) -> None:
    """`langflash view`."""
    view = new_command(commands, "view", "open the window; drop photos, films or scenes on it")
    told = "photos, a film, a folder of either, or one scene"
    view.add_argument("paths", nargs="*", type=Path, metavar="PHOTO|FILM|SCENE", help=told)


def add_reconstruct(commands) -> None:
    """`langflash reconstruct`."""
    command = new_command(commands, "reconstruct", "make a scene from photos or a film of one place")
    command.add_argument(
        "photos",
        nargs="+",
        type=Path,
        metavar="PHOTO|FILM|FOLDER",
        help="photos, a film, or a folder: its photos in the order of their names, or its films if it has no "
        "photos; of a film the sharpest frames are used, as `langflash frames` chooses them",
    )
    add_output(command, "SCENE", "the scene to write")
    command.add_argument(
        "--frames", type=frame_count, metavar="N", help="use at most N frames of a film (default: 32)"
    )
    add_film_part(command)
    add_network(command)
    add_detail(command)
    command.add_argument(
        "--aggregation",
        choices=AGGREGATIONS,
        help="how a group gets its vector: trained, the average of dense features, or CLIP on a cut-out "
        "(default: lfa where it has weights, else average)",
    )
    command.add_argument(
        "--grouping",
        choices=GROUPINGS,
        help="where groups come from: trained queries, the same with MobileSAM's outlines where its weights "
        "are installed, or masks of SAM 2 lifted to the scene (default: queries where they have weights, "
        "else sam2 where it is installed, else the language features)",
    )
    command.add_argument(
        "--precision",
        choices=PRECISIONS,
        default="auto",
        help="auto: bfloat16 on graphics cards and, for full, on processors with instructions for it "
        "(default: auto)",
    )
    lens = command.add_mutually_exclusive_group()
    lens.add_argument("--fov", type=open_fov, metavar="DEG", help="field of view of the photos' longer side")
    lens.add_argument(
        "--intrinsics",
        type=intrinsics,
        metavar="FX,FY,CX,CY",
        help="the lens, in pixels of the photos as given, after EXIF orientation",
    )
    command.add_argument(
        "--poses",
        type=Path,
        metavar="PATH",
        help="use the poses and lenses of this transforms.json or COLMAP model instead of finding them; the "
        "scene is then in their world and unit",
    )
    command.add_argument(
        "--keep",
        type=Path,
        metavar="FOLDER",
        help="save progress there until the scene is written; the same command continues from it",
    )
    add_json(command)


def add_add(commands) -> None:
    """`langflash add`."""
    command = new_command(commands, "add", "put more photos into a finished scene")
    command.add_argument("scene", type=Path, metavar="SCENE")
    command.add_argument("photos", nargs="+", type=Path, metavar="PHOTO", help="of the same place")
    add_output(command, "SCENE", "the scene to write")
    command.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto")
    add_json(command)


def add_frames(commands) -> None:
    """`langflash frames`."""
    command = new_command(
        commands,
        "frames",
        "pick the sharpest frames of a film as photos, spaced by how far the camera moves",
        epilog="A film is decoded only once. Frames are at most 1920 pixels long.",
    )
    command.add_argument("film", type=Path, metavar="FILM", help=".mp4, .mov, .mkv, .webm, .avi and others")
    add_output(command, "FOLDER", "the folder to write: frames, named by their times, and frames.json")
    command.add_argument(
        "--most",
        type=frame_count,
        metavar="N",
        help="at most N frames (default: 32, as for `langflash reconstruct`)",
    )
    add_film_part(command)
    command.add_argument(
        "--every",
        type=above_zero,
        metavar="S",
        help="the sharpest frame every S seconds, however far the camera moves",
    )
    command.add_argument("--sheet", type=Path, metavar="IMG", help="also write them as one .png or .jpg")
    add_json(command)


def add_batch(commands) -> None:
    """`langflash batch`."""
    command = new_command(
        commands,
        "batch",
        "make scenes from many sets of photos; continues where it was interrupted",
        epilog="The exit code is 0 when all sets are done, 1 when some failed (ledger.csv says why), "
        "2 for bad input, 130 after Ctrl-C.",
    )
    command.add_argument(
        "sets",
        type=Path,
        metavar="SETS",
        help="a folder with one sub-folder of photos per place, or a .csv with a name and its photos per "
        "row, relative to the table",
    )
    add_output(command, "OUT", "the folder to write: one folder per set, ledger.csv and summary.html")
    command.add_argument(
        "--prompt", nargs="+", metavar="PHRASE", help="look for these in the first photo of each set"
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
        help="number of processes side by side; each needs about 1 GB "
        "(default: one per processor, as memory allows)",
    )
    command.add_argument(
        "--address",
        metavar="RAY",
        help="use a Ray cluster instead of processes: host:port, auto, or local to start one here; all its "
        "machines must see the photos and OUT under the same paths",
    )
    add_network(command)
    add_detail(command)
    command.add_argument(
        "--fov", type=open_fov, metavar="DEG", help="field of view of the photos' longer side, for all sets"
    )
    add_backend(command)
    add_json(command)


def add_query(commands) -> None:
    """`langflash query`."""
    command = new_command(
        commands, "query", "find phrases in a scene; with -o also writes heat-maps and masks"
    )
    command.add_argument("scene", nargs="?", metavar="SCENE", help="the scene to ask")
    command.add_argument("phrases", nargs="*", metavar="PROMPT", help='a phrase, e.g. "armchair"')
    command.add_argument(
        "--scenes",
        type=Path,
        metavar="FOLDER",
        help="ask all scenes in a folder: a table of answers, surest first, and a page of pictures",
    )
    command.add_argument(
        "--prompts",
        dest="phrase_file",
        type=Path,
        metavar="FILE",
        help="read phrases from a text file, one per line",
    )
    command.add_argument(
        "--words",
        dest="vocabulary",
        type=Path,
        metavar="FILE",
        help="use the names that `langflash words learn` saved",
    )
    add_camera(command)
    command.add_argument(
        "--mode", choices=("relevancy", "cosine"), default="relevancy", help="(default: relevancy)"
    )
    command.add_argument(
        "--negatives",
        nargs="+",
        metavar="PHRASE",
        help="phrases that relevancy compares with (default: the language space's own)",
    )
    add_backend(command)
    add_output(command, "DIR", "the folder for pictures (default: none are written)", required=False)
    add_json(command)
    command.add_argument(
        "--npz", action="store_true", help="also write relevance, masks, depth and rgb as arrays"
    )
    add_colours(command)


def add_render(commands) -> None:
    """`langflash render`."""
    command = new_command(commands, "render", "draw one picture of a scene")
    command.add_argument("scene", type=Path, metavar="SCENE")
    add_output(command, "IMG", "the .png to write")
    add_camera(command)
    command.add_argument(
        "--what",
        type=what,
        default=(pictures.RGB, pictures.RGB.word, None),
        metavar="|".join(pictures.WORDS),
        help="(default: rgb)",
    )
    command.add_argument(
        "--prompt", nargs="+", metavar="PHRASE", help="phrases for relevance (one) and labels (any number)"
    )
    add_shown(command)
    add_colours(command)
    add_axes(command)
    add_backend(command)
    add_json(command)


def add_export(commands) -> None:
    """`langflash export`."""
    command = new_command(
        commands, "export", "write a scene, or what a phrase finds, as a file for other programs"
    )
    command.add_argument("scene", type=Path, metavar="SCENE")
    add_output(
        command,
        "FILE",
        help_of_files(),
    )
    command.add_argument(
        "--prompt",
        nargs="+",
        metavar="PHRASE",
        help="keep only what these find; in an .html they are shown as asked",
    )
    command.add_argument(
        "--threshold", type=kept_fraction, metavar="T", help="keep what scores at least T, between 0 and 1"
    )
    command.add_argument(
        "--what",
        choices=WORDS,
        help=help_of_words(),
    )
    command.add_argument(
        "--segmented",
        action="store_true",
        help="write a folder: masks, soft masks, cut-outs and instances of --prompt and depth for every "
        "photo, boxes, surfaces, a contact sheet and manifest.json",
    )
    add_colours(command)
    command.add_argument(
        "--all-views", action="store_true", help="one file per photo: FILE_1, FILE_2 and so on"
    )
    command.add_argument("--with-text", action="store_true", help="an .html answers any phrase; adds 28 MB")
    command.add_argument(
        "--beside",
        nargs="+",
        type=Path,
        default=(),
        metavar="SCENE",
        help="add other scenes to the same .html; they are asked the same phrases",
    )
    command.add_argument(
        "--detail",
        choices=EXPORT_DETAILS,
        default=EXPORT_DETAILS[0],
        help="low keeps only coarse Gaussians, for small files and slow machines; in a scene without levels "
        f"it keeps a third, made wider (default: {EXPORT_DETAILS[0]})",
    )
    command.add_argument(
        "--upright",
        action="store_true",
        help="write Gaussians and poses level, on the floor and turned north, as `langflash level` found, in "
        "metres if they are known",
    )
    command.add_argument("--seconds", type=film_seconds, metavar="S", help="length of a video (default: 6)")
    command.add_argument(
        "--path",
        metavar="WAY",
        help="how a video moves: photos, from one to the next and back (default); orbit, around the scene; "
        "tour, along the scene's stops; or a JSON list of cameras as for --camera, each with its time in "
        "seconds, or evenly spread",
    )
    command.add_argument(
        "--replace",
        action="store_true",
        help="also replace a .json of another kind, and files named like a legend or a COCO picture",
    )
    add_camera(command)
    add_shown(command)
    add_axes(command, written=True)
    add_backend(command)


def add_lift(commands) -> None:
    """`langflash lift`."""
    command = new_command(commands, "lift", "make a plain splat file answer phrases")
    command.add_argument("scene", type=Path, metavar="SCENE", help="a splat file, or a scene to teach again")
    add_output(command, "SCENE", "the .langflash to write, or a .ply or .glb with its language")
    command.add_argument(
        "--photos",
        nargs="+",
        type=Path,
        metavar="PHOTO",
        help="photos of the place, with --poses (default: views of the splats themselves)",
    )
    command.add_argument("--poses", type=Path, metavar="PATH", help="transforms.json, or a COLMAP model")
    command.add_argument(
        "--up",
        choices=("x", "y", "z", "-x", "-y", "-z"),
        default="-y",
        metavar="AXIS",
        help="the axis that points up, for views of the splats themselves: z, or --up=-z and so on "
        "(default: -y)",
    )
    command.add_argument(
        "--weights", type=Path, metavar="PATH", help="use this checkpoint instead of the shipped ones"
    )
    add_axes(command)
    add_backend(command)
    add_json(command)


def add_hide(commands) -> None:
    """`langflash hide`."""
    command = new_command(
        commands,
        "hide",
        "blur, pixelate or remove what a phrase finds, in the scene and its photos, for good",
        epilog="The written file no longer holds what was hidden. The scene that was read, and "
        "photos and films on the disk, still show it.",
    )
    command.add_argument("scene", type=Path, metavar="SCENE")
    command.add_argument("prompts", nargs="+", metavar="PHRASE", help='such as "person", "picture", "screen"')
    add_output(command, "SCENE", "the .langflash to write")
    command.add_argument(
        "--how",
        choices=HOWS,
        default=HOWS[0],
        help=f"blurred, as large pixels, or not at all (default: {HOWS[0]})",
    )
    command.add_argument(
        "--blocks",
        type=above_zero,
        metavar="N",
        help="for blur and pixels: blocks along the longest side of the largest thing, 1 to 16 (default: 6)",
    )
    command.add_argument(
        "--margin",
        type=share,
        metavar="SHARE",
        help="hide this much around it too, as a share of a photo's longer side (default: 0.02)",
    )
    command.add_argument(
        "--threshold", type=kept_fraction, metavar="T", help="hide what scores at least T, between 0 and 1"
    )
    command.add_argument(
        "--open",
        action="store_true",
        help="for remove: leave the hole open instead of filling it from what is around it",
    )
    command.add_argument(
        "--photos",
        choices=("painted", "none"),
        default="painted",
        help="photos in the file: painted over where they show it, or left out (default: painted)",
    )
    command.add_argument(
        "--preview", type=Path, metavar="IMG", help="a .png: what is hidden, in red, and after"
    )
    add_backend(command)
    add_json(command)


def add_clean(commands) -> None:
    """`langflash clean`."""
    command = new_command(
        commands,
        "clean",
        "remove floaters, sheets, flyaways and crumbs, by strength, by rules, or by a recipe",
        epilog='A rule is a condition or several: "opacity<.1", "size>.2,depth>5", "photos<2", '
        '"confidence<.2", "colour~#808080:.1". Photos inside the file stay as they are.',
    )
    command.add_argument("scene", type=Path, metavar="SCENE")
    add_output(command, "SCENE", "the .langflash to write")
    command.add_argument(
        "--strength",
        type=share,
        metavar="T",
        help="how much to remove, 0 to 1 (default: 0.5 without other rules)",
    )
    command.add_argument(
        "--kinds", nargs="+", choices=KINDS, metavar="KIND", help=f"remove {', '.join(KINDS)} (default: all)"
    )
    command.add_argument(
        "--where", nargs="+", metavar="RULE", help="also remove what meets all of one of these rules"
    )
    command.add_argument("--within", nargs="+", metavar="PHRASE", help="only within what these find")
    command.add_argument("--invert", action="store_true", help="remove the rest instead")
    command.add_argument(
        "--crop",
        metavar="BOX",
        help="keep only what is inside: core, room, or --crop=X,Y,Z,X,Y,Z, low and high corner",
    )
    command.add_argument("--recipe", type=Path, metavar="FILE", help="read all of these settings from a file")
    command.add_argument(
        "--save-recipe", type=Path, metavar="FILE", help="save these settings as a .json, for other scenes"
    )
    command.add_argument("--fill", action="store_true", help="fill what was removed from what is around it")
    command.add_argument(
        "--preview", type=Path, metavar="IMG", help="write a .png: what goes, in red, and after"
    )
    add_axes(command)
    add_backend(command)
    add_json(command)


def add_level(commands) -> None:
    """`langflash level`."""
    command = new_command(
        commands,
        "level",
        "find which way is up, the floor, north and the likely scale",
    )
    command.add_argument("scene", type=Path, metavar="SCENE")
    command.add_argument(
        "-o", "--output", type=Path, metavar="SCENE", help="write the scene with it (default: only print it)"
    )
    command.add_argument("--up", type=spot, metavar="X,Y,Z", help="this way is up, in the scene's own axes")
    command.add_argument("--north", type=spot, metavar="X,Y,Z", help="this way is north")
    command.add_argument("--origin", type=spot, metavar="X,Y,Z", help="this point lies at 0, on the floor")
    lengths = command.add_mutually_exclusive_group()
    lengths.add_argument(
        "--length",
        nargs=3,
        metavar=("A", "B", "METRES"),
        help="the distance from A to B; both are points X,Y,Z of the scene, or pixels PHOTO:U,V of a photo "
        "as the scene has it, photos counted from 1",
    )
    lengths.add_argument("--ceiling", type=above_zero, metavar="METRES", help="the height of the ceiling")
    lengths.add_argument("--door", type=above_zero, metavar="METRES", help="the height of the door")
    add_axes(command)
    add_json(command)


def add_inventory(commands) -> None:
    """`langflash inventory`."""
    command = new_command(
        commands,
        "inventory",
        "list what is in a room, with size, place and certainty; or what changed since another scene",
    )
    command.add_argument("scene", type=Path, metavar="SCENE")
    command.add_argument(
        "-o",
        "--output",
        nargs="+",
        type=Path,
        metavar="FILE",
        help=".html: a page to print, with cut-outs and a plan; .csv, .json: the list; .svg, .dxf: the floor "
        "plan, to scale; .langflash: the scene with the names of --name",
    )
    command.add_argument(
        "--name",
        nargs="+",
        metavar='"CHAIR 1=NAME"',
        help="your own name for a thing; nothing after = removes it",
    )
    command.add_argument(
        "--beside",
        type=Path,
        metavar="SCENE",
        help="a later scene of the same room: list what came, went and moved",
    )
    command.add_argument(
        "--threshold", type=kept_fraction, metavar="T", help="list things that score at least T, from 0 to 1"
    )
    add_backend(command)
    add_json(command)


def add_info(commands) -> None:
    """`langflash info`."""
    command = new_command(commands, "info", "show what a scene file holds, and what pruning saved")
    command.add_argument("scene", type=Path, nargs="?", metavar="SCENE", help=".langflash or a splat file")
    command.add_argument(
        "--sbom", action="store_true", help="list what is installed, as a bill of materials (CycloneDX JSON)"
    )
    command.add_argument(
        "--limits", action="store_true", help="list how large files may be, and the variables that change it"
    )
    add_axes(command)
    add_json(command)


def add_words(commands) -> None:
    """`langflash words`."""
    actions = new_actions(commands, "words", "save the names taught in some scenes, and teach them to others")
    learn = new_command(actions, "learn", "save the names and denials of scenes as a vocabulary")
    learn.add_argument("scenes", nargs="+", type=Path, metavar="SCENE", help="scenes whose groups have names")
    add_output(learn, "FILE", "the vocabulary, .words.json; an existing one is added to")
    add_json(learn)
    teach = new_command(actions, "teach", "name the groups of a scene from a vocabulary")
    teach.add_argument("scene", type=Path, metavar="SCENE")
    teach.add_argument("words", type=Path, metavar="FILE", help="the vocabulary")
    add_output(teach, "SCENE", "the scene to write")
    add_json(teach)
    listing = new_command(actions, "list", "list what a vocabulary holds")
    listing.add_argument("words", type=Path, metavar="FILE", help="the vocabulary")
    add_json(listing)


def add_weights(commands) -> None:
    """`langflash weights`."""
    actions = new_actions(commands, "weights", "list, download and check the checkpoints of the networks")
    listing = new_command(
        actions, "list", "name, size and origin of each checkpoint, and which can be downloaded"
    )
    add_json(listing)
    get = new_command(
        actions, "get", "download a published checkpoint and convert it; continues where it stopped"
    )
    get.add_argument("name", metavar="NAME", help="a name from `langflash weights list`")
    get.add_argument("--keep", action="store_true", help="keep the file as it was downloaded")
    add_json(get)
    imported = new_command(actions, "import", "convert a published checkpoint that is already here")
    imported.add_argument("path", type=Path, metavar="PATH", help=".ckpt, .pt or .safetensors")
    imported.add_argument("--preset", choices=("full",), default="full", help="(default: full)")
    imported.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="(default: the cache folder, where it is looked for)",
    )
    imported.add_argument(
        "--size",
        type=pixel_side,
        metavar="PX",
        help="the photo size that it was trained on, PX x PX (default: from its published name)",
    )
    add_json(imported)
    verify = new_command(actions, "verify", "read every number and check that it fits its network")
    verify.add_argument(
        "paths", nargs="*", type=Path, metavar="PATH", help="checkpoints (default: the shipped ones)"
    )
    add_json(verify)
