"""The words of making, asking, drawing and exporting scenes, and of weights."""

from pathlib import Path

from langflash_core import pictures
from langflash_core.detail import EXPORT_DETAILS
from langflash_core.mending.recipes import HOWS, KINDS
from langflash_core.network.presets import AGGREGATIONS, GROUPINGS, PRECISIONS
from langflash_core.outputs import WORDS, help_of_files, help_of_words

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
    view = new_command(commands, "view", "open the window; photos, films and scenes can be dropped on it")
    view.add_argument(
        "paths", nargs="*", type=Path, metavar="PHOTO|FILM|SCENE", help="photos, a film, or one scene"
    )


def add_reconstruct(commands) -> None:
    """`langflash reconstruct`."""
    command = new_command(commands, "reconstruct", "make a scene of photos of one place, or of a film of it")
    command.add_argument(
        "photos",
        nargs="+",
        type=Path,
        metavar="PHOTO|FILM|FOLDER",
        help="a folder stands for the photos directly in it, in the order of their names, or else for its "
        "films; of a film its sharpest frames are taken, as `langflash frames` chooses them",
    )
    add_output(command, "SCENE", "the scene to write")
    command.add_argument(
        "--frames",
        type=frame_count,
        metavar="N",
        help="of a film, at most so many (default: 32)",
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
    command.add_argument(
        "--refine",
        type=above_zero,
        metavar="SECONDS",
        help="then fit poses and one surface of Gaussians, without layers, to the photos, and keep that if a "
        "held-out view improves",
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
        help="a transforms.json or COLMAP model with the photos' poses and lenses: they are not sought, "
        "and the scene is in their world and unit",
    )
    command.add_argument(
        "--keep",
        type=Path,
        metavar="FOLDER",
        help="what is done is kept there until the scene is written: the same command goes on from there",
    )
    add_json(command)


def add_frames(commands) -> None:
    """`langflash frames`."""
    command = new_command(
        commands,
        "frames",
        "take the sharpest frames of a film as photos, spaced by how far the picture moves",
        epilog="A film that was looked at is not decoded again. Frames are at most 1920 pixels long.",
    )
    command.add_argument("film", type=Path, metavar="FILM", help=".mp4, .mov, .mkv, .webm, .avi and others")
    add_output(command, "FOLDER", "gets the frames, named by their times, and frames.json")
    command.add_argument(
        "--most",
        type=frame_count,
        metavar="N",
        help="at most so many (default: 32, as `langflash reconstruct` takes)",
    )
    add_film_part(command)
    command.add_argument(
        "--every",
        type=above_zero,
        metavar="S",
        help="the sharpest frame of every so many seconds, however far the picture moves",
    )
    command.add_argument("--sheet", type=Path, metavar="IMG", help="a .png or .jpg that shows all of them")
    add_json(command)


def add_batch(commands) -> None:
    """`langflash batch`."""
    command = new_command(
        commands,
        "batch",
        "make scenes of many sets of photos; what is done is not done again, also after an interruption",
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
    add_output(command, "OUT", "gets a folder a set, ledger.csv and summary.html")
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
    add_network(command)
    add_detail(command)
    command.add_argument(
        "--fov", type=open_fov, metavar="DEG", help="field of view of the photos' longer side, of all sets"
    )
    add_backend(command)
    add_json(command)


def add_query(commands) -> None:
    """`langflash query`."""
    command = new_command(
        commands, "query", "find phrases in a scene: a line each; with -o also heat-maps and masks"
    )
    command.add_argument("scene", nargs="?", metavar="SCENE", help="the scene to ask")
    command.add_argument("phrases", nargs="*", metavar="PROMPT", help='a phrase, e.g. "armchair"')
    command.add_argument(
        "--scenes",
        type=Path,
        metavar="FOLDER",
        help="ask all scenes of a folder: a table of answers, the surest first, and a page of pictures",
    )
    command.add_argument(
        "--prompts",
        dest="phrase_file",
        type=Path,
        metavar="FILE",
        help="phrases from a text file, one a line",
    )
    command.add_argument(
        "--words",
        dest="vocabulary",
        type=Path,
        metavar="FILE",
        help="what `langflash words learn` kept: groups that look alike answer to it",
    )
    add_camera(command)
    command.add_argument(
        "--mode", choices=("relevancy", "cosine"), default="relevancy", help="(default: relevancy)"
    )
    command.add_argument(
        "--negatives",
        nargs="+",
        metavar="PHRASE",
        help="what relevancy compares with (default: the language space's own)",
    )
    add_backend(command)
    add_output(command, "DIR", "folder for pictures; without it nothing is written", required=False)
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
        "--prompt", nargs="+", metavar="PHRASE", help="for relevance (one) and labels (any number)"
    )
    add_shown(command)
    add_colours(command)
    add_axes(command)
    add_backend(command)
    add_json(command)


def add_export(commands) -> None:
    """`langflash export`."""
    command = new_command(
        commands, "export", "write a scene, or what answers a phrase, as a file for other programs"
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
        help="keep only what answers one of these; of an .html: shown as asked",
    )
    command.add_argument(
        "--threshold", type=kept_fraction, metavar="T", help="relevancy to keep, between 0 and 1"
    )
    command.add_argument(
        "--what",
        choices=WORDS,
        help=help_of_words(),
    )
    command.add_argument(
        "--segmented",
        action="store_true",
        help="a folder: of every photo's view masks, soft masks, cut-outs and instances of --prompt, and "
        "depth; boxes, surfaces, a contact sheet and manifest.json",
    )
    add_colours(command)
    command.add_argument(
        "--all-views", action="store_true", help="from every photo: FILE_1, FILE_2 and so on"
    )
    command.add_argument(
        "--with-text", action="store_true", help="an .html answers any phrase, and is 28 MB larger"
    )
    command.add_argument(
        "--beside",
        nargs="+",
        type=Path,
        default=(),
        metavar="SCENE",
        help="other scenes in the same .html, which are asked the same phrases",
    )
    command.add_argument(
        "--detail",
        choices=EXPORT_DETAILS,
        default=EXPORT_DETAILS[0],
        help="of Gaussians and web pages: low keeps the coarse ones alone, for small files, slow machines; "
        f"of a scene without levels a third, wider (default: {EXPORT_DETAILS[0]})",
    )
    command.add_argument(
        "--upright",
        action="store_true",
        help="of Gaussians and poses: level, on the floor and turned north as `langflash level` found it, in "
        "metres where they are known",
    )
    command.add_argument("--seconds", type=film_seconds, metavar="S", help="length of a video (default: 6)")
    command.add_argument(
        "--path",
        metavar="WAY",
        help="of a video: photos, from one to the next and back (default); orbit, around what is shown; "
        "tour, along the scene's stops; or a JSON list of cameras as of --camera, each with its time in "
        "seconds, or evenly spread",
    )
    command.add_argument(
        "--replace",
        action="store_true",
        help="also a .json of another kind, and what has the name of a legend or a COCO picture",
    )
    add_camera(command)
    add_shown(command)
    add_axes(command, written=True)
    add_backend(command)


def add_lift(commands) -> None:
    """`langflash lift`."""
    command = new_command(
        commands, "lift", "give plain splats groups and a dictionary, so that they answer phrases"
    )
    command.add_argument("scene", type=Path, metavar="SCENE", help="a splat file, or a scene to name anew")
    add_output(command, "SCENE", "the .langflash, or .ply or .glb with its language, to write")
    command.add_argument(
        "--photos",
        nargs="+",
        type=Path,
        metavar="PHOTO",
        help="of the place, with --poses; else views of itself",
    )
    command.add_argument("--poses", type=Path, metavar="PATH", help="transforms.json, or a COLMAP model")
    command.add_argument(
        "--up",
        choices=("x", "y", "z", "-x", "-y", "-z"),
        default="-y",
        metavar="AXIS",
        help="of views of itself: the scene's axis that points up: z, or --up=-z and so on (default: -y)",
    )
    command.add_argument(
        "--weights", type=Path, metavar="PATH", help="a checkpoint instead of the shipped ones"
    )
    add_axes(command)
    add_backend(command)
    add_json(command)


def add_hide(commands) -> None:
    """`langflash hide`."""
    command = new_command(
        commands,
        "hide",
        "blur, pixelate or remove what answers a phrase, in the scene and its photos, for good",
        epilog="What was hidden is not in the file that is written. The scene that was read, and "
        "photos and films on the disk, still show it.",
    )
    command.add_argument("scene", type=Path, metavar="SCENE")
    command.add_argument("prompts", nargs="+", metavar="PHRASE", help='such as "person", "picture", "screen"')
    add_output(command, "SCENE", "the .langflash to write")
    command.add_argument(
        "--how",
        choices=HOWS,
        default=HOWS[0],
        help=f"as colours that run together, as large pixels, or not at all (default: {HOWS[0]})",
    )
    command.add_argument(
        "--blocks",
        type=above_zero,
        metavar="N",
        help="blur and pixels: blocks along the longest side of the largest thing, 1 to 16 (default: 6)",
    )
    command.add_argument(
        "--margin",
        type=share,
        metavar="SHARE",
        help="around it, of a photo's longer side: hidden, too (default: 0.02)",
    )
    command.add_argument(
        "--threshold",
        type=kept_fraction,
        metavar="T",
        help="relevancy from which it is hidden, between 0 and 1",
    )
    command.add_argument(
        "--open",
        action="store_true",
        help="remove: leave the hole open instead of filling it by what is around",
    )
    command.add_argument(
        "--photos",
        choices=("painted", "none"),
        default="painted",
        help="inside the file: painted over where they show it, or left out (default: painted)",
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
        "take away floaters, sheets, flyaways and crumbs, by strength, by rules, or as a recipe says",
        epilog='A rule is a condition or several: "opacity<.1", "size>.2,depth>5", "photos<2", '
        '"confidence<.2", "colour~#808080:.1". Photos inside the file stay as they are.',
    )
    command.add_argument("scene", type=Path, metavar="SCENE")
    add_output(command, "SCENE", "the .langflash to write")
    command.add_argument(
        "--strength", type=share, metavar="T", help="0 to 1 (default: 0.5 where nothing else is asked for)"
    )
    command.add_argument(
        "--kinds", nargs="+", choices=KINDS, metavar="KIND", help=f"of {', '.join(KINDS)} (default: all)"
    )
    command.add_argument(
        "--where", nargs="+", metavar="RULE", help="also what meets all conditions of one of these"
    )
    command.add_argument("--within", nargs="+", metavar="PHRASE", help="only of what answers one of these")
    command.add_argument("--invert", action="store_true", help="the others instead")
    command.add_argument(
        "--crop",
        metavar="BOX",
        help="only what is inside stays: core, room, or --crop=X,Y,Z,X,Y,Z, low and high corner",
    )
    command.add_argument("--recipe", type=Path, metavar="FILE", help="all of that, as a file says")
    command.add_argument("--save-recipe", type=Path, metavar="FILE", help="a .json, for other scenes")
    command.add_argument("--fill", action="store_true", help="fill what was removed from what is around it")
    command.add_argument("--preview", type=Path, metavar="IMG", help="a .png: what goes, in red, and after")
    add_axes(command)
    add_backend(command)
    add_json(command)


def add_level(commands) -> None:
    """`langflash level`."""
    command = new_command(
        commands,
        "level",
        "find which way is up, where the floor is, which way is north, and how large it may be",
    )
    command.add_argument("scene", type=Path, metavar="SCENE")
    command.add_argument(
        "-o", "--output", type=Path, metavar="SCENE", help="the scene with that in it (default: only say it)"
    )
    command.add_argument("--up", type=spot, metavar="X,Y,Z", help="this way is up, in the scene's own axes")
    command.add_argument("--north", type=spot, metavar="X,Y,Z", help="this way is north")
    command.add_argument("--origin", type=spot, metavar="X,Y,Z", help="this point lies at 0, on the floor")
    lengths = command.add_mutually_exclusive_group()
    lengths.add_argument(
        "--length",
        nargs=3,
        metavar=("A", "B", "METRES"),
        help="from A to B it is so long; A and B are points X,Y,Z of the scene, or pixels PHOTO:U,V of a "
        "photo as the scene has it",
    )
    lengths.add_argument("--ceiling", type=above_zero, metavar="METRES", help="the ceiling is so high")
    lengths.add_argument("--door", type=above_zero, metavar="METRES", help="the door is so high")
    add_axes(command)
    add_json(command)


def add_inventory(commands) -> None:
    """`langflash inventory`."""
    command = new_command(
        commands,
        "inventory",
        "list what is in a room, how large, where, how sure; what changed since another scene",
    )
    command.add_argument("scene", type=Path, metavar="SCENE")
    command.add_argument(
        "-o",
        "--output",
        nargs="+",
        type=Path,
        metavar="FILE",
        help=".html: a page to print, with cut-outs and a plan; .csv, .json: the list; .svg, .dxf: the plan "
        "from above, to scale; .langflash: the scene with the names of --name",
    )
    command.add_argument(
        "--name",
        nargs="+",
        metavar='"CHAIR 1=NAME"',
        help="what you call a thing; nothing after = takes it away",
    )
    command.add_argument(
        "--beside", type=Path, metavar="SCENE", help="a later scene of the room: what came, went and moved"
    )
    command.add_argument(
        "--threshold", type=kept_fraction, metavar="T", help="relevancy of a thing to its name, from 0 to 1"
    )
    add_backend(command)
    add_json(command)


def add_info(commands) -> None:
    """`langflash info`."""
    command = new_command(commands, "info", "tell what a scene file holds, and what pruning saved")
    command.add_argument("scene", type=Path, nargs="?", metavar="SCENE", help=".langflash or a splat file")
    command.add_argument(
        "--sbom", action="store_true", help="what is installed, as a bill of materials (CycloneDX JSON)"
    )
    command.add_argument(
        "--limits", action="store_true", help="how much readers take of a file, and the variables that say so"
    )
    add_axes(command)
    add_json(command)


def add_words(commands) -> None:
    """`langflash words`."""
    actions = new_actions(commands, "words", "keep what was taught in some scenes, and teach it to others")
    learn = new_command(actions, "learn", "names and denials that scenes were given, into a vocabulary")
    learn.add_argument(
        "scenes", nargs="+", type=Path, metavar="SCENE", help="scenes in which groups were named"
    )
    add_output(learn, "FILE", "the vocabulary, .words.json; one that is there is added to")
    add_json(learn)
    teach = new_command(actions, "teach", "a scene whose groups take what a vocabulary says of such things")
    teach.add_argument("scene", type=Path, metavar="SCENE")
    teach.add_argument("words", type=Path, metavar="FILE", help="the vocabulary")
    add_output(teach, "SCENE", "the scene to write")
    add_json(teach)
    listing = new_command(actions, "list", "what a vocabulary holds")
    listing.add_argument("words", type=Path, metavar="FILE", help="the vocabulary")
    add_json(listing)


def add_weights(commands) -> None:
    """`langflash weights`."""
    actions = new_actions(commands, "weights", "list, fetch and check the checkpoints of the networks")
    listing = new_command(actions, "list", "name, size and origin of each checkpoint, and what can be had")
    add_json(listing)
    get = new_command(
        actions, "get", "download a published checkpoint and convert it; continues where it stopped"
    )
    get.add_argument("name", metavar="NAME", help="as `langflash weights list` has it")
    get.add_argument("--url", metavar="URL", help="fetch it from there instead")
    get.add_argument("--keep", action="store_true", help="keep the file as it was downloaded")
    add_json(get)
    imported = new_command(actions, "import", "convert a published checkpoint that is already here")
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
    add_json(imported)
    verify = new_command(actions, "verify", "read every number and check that it fits its network")
    verify.add_argument(
        "paths", nargs="*", type=Path, metavar="PATH", help="checkpoints (default: the shipped ones)"
    )
    add_json(verify)
