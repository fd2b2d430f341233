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
    add_device,
    add_film_part,
    add_json,
    add_network,
    add_output,
    add_shown,
    add_switch,
    add_value,
    new_actions,
    new_command,
)

_FOV = "field of view of the photos' longer side"


def add_view(commands) -> None:
    """`langflash view`."""
    view = new_command(commands, "view", "open the window; drop photos, films or scenes on it")
    told = "photos, a film, a folder of either, or one scene"
    add_value(view, "paths PHOTO|FILM|SCENE", Path, told, nargs="*")


def add_reconstruct(commands) -> None:
    """`langflash reconstruct`."""
    command = new_command(commands, "reconstruct", "make a scene from photos or a film of one place")
    add_value(
        command,
        "photos PHOTO|FILM|FOLDER",
        Path,
        "photos, a film, or a folder: its photos in the order of their names, or its films if it has no "
        "photos; of a film the sharpest frames are used, as `langflash frames` chooses them",
        nargs="+",
    )
    add_output(command, "SCENE", "the scene to write")
    add_value(command, "--frames N", frame_count, "use at most N frames of a film (default: 32)")
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
    add_value(lens, "--fov DEG", open_fov, _FOV)
    add_value(
        lens,
        "--intrinsics FX,FY,CX,CY",
        intrinsics,
        "the lens, in pixels of the photos as given, after EXIF orientation",
    )
    add_value(
        command,
        "--poses PATH",
        Path,
        "use the poses and lenses of this transforms.json or COLMAP model instead of finding them; the "
        "scene is then in their world and unit",
    )
    add_value(
        command,
        "--keep FOLDER",
        Path,
        "save progress there until the scene is written; the same command continues from it",
    )
    add_json(command)


def add_add(commands) -> None:
    """`langflash add`."""
    command = new_command(commands, "add", "put more photos into a finished scene")
    add_value(command, "scene SCENE", Path)
    add_value(command, "photos PHOTO", Path, "of the same place", nargs="+")
    add_output(command, "SCENE", "the scene to write")
    add_device(command)
    add_json(command)


def add_frames(commands) -> None:
    """`langflash frames`."""
    command = new_command(
        commands,
        "frames",
        "pick the sharpest frames of a film as photos, spaced by how far the camera moves",
        epilog="A film is decoded only once. Frames are at most 1920 pixels long.",
    )
    add_value(command, "film FILM", Path, ".mp4, .mov, .mkv, .webm, .avi and others")
    add_output(command, "FOLDER", "the folder to write: frames, named by their times, and frames.json")
    told = "at most N frames (default: 32, as for `langflash reconstruct`)"
    add_value(command, "--most N", frame_count, told)
    add_film_part(command)
    told = "the sharpest frame every S seconds, however far the camera moves"
    add_value(command, "--every S", above_zero, told)
    add_value(command, "--sheet IMG", Path, "also write them as one .png or .jpg")
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
    add_value(
        command,
        "sets SETS",
        Path,
        "a folder with one sub-folder of photos per place, or a .csv with a name and its photos per "
        "row, relative to the table",
    )
    add_output(command, "OUT", "the folder to write: one folder per set, ledger.csv and summary.html")
    add_value(command, "--prompt PHRASE", str, "look for these in the first photo of each set", nargs="+")
    add_value(
        command,
        "--export ENDING",
        str,
        "files to write besides the scene, as `langflash export` does: .ply, .spz, .glb, .png, "
        "transforms.json and others of the whole scene; .json (masks) and .csv (boxes) of --prompt",
        nargs="+",
    )
    add_value(
        command,
        "--workers N",
        whole_count,
        "number of processes side by side; each needs about 1 GB "
        "(default: one per processor, as memory allows)",
    )
    add_value(
        command,
        "--address RAY",
        str,
        "use a Ray cluster instead of processes: host:port, auto, or local to start one here; all its "
        "machines must see the photos and OUT under the same paths",
    )
    add_network(command)
    add_detail(command)
    add_value(command, "--fov DEG", open_fov, f"{_FOV}, for all sets")
    add_backend(command)
    add_json(command)


def add_query(commands) -> None:
    """`langflash query`."""
    purpose = "find phrases in a scene; with -o also writes heat-maps and masks"
    command = new_command(commands, "query", purpose)
    add_value(command, "scene SCENE", str, "the scene to ask", nargs="?")
    add_value(command, "phrases PROMPT", str, 'a phrase, e.g. "armchair"', nargs="*")
    told = "ask all scenes in a folder: a table of answers, surest first, and a page of pictures"
    add_value(command, "--scenes FOLDER", Path, told)
    told = "read phrases from a text file, one per line"
    add_value(command, "--prompts FILE", Path, told, dest="phrase_file")
    told = "use the names that `langflash words learn` saved"
    add_value(command, "--words FILE", Path, told, dest="vocabulary")
    add_camera(command)
    command.add_argument(
        "--mode", choices=("relevancy", "cosine"), default="relevancy", help="(default: relevancy)"
    )
    told = "phrases that relevancy compares with (default: the language space's own)"
    add_value(command, "--negatives PHRASE", str, told, nargs="+")
    add_backend(command)
    add_output(command, "DIR", "the folder for pictures (default: none are written)", required=False)
    add_json(command)
    add_switch(command, "--npz", "also write relevance, masks, depth and rgb as arrays")
    add_colours(command)


def add_render(commands) -> None:
    """`langflash render`."""
    command = new_command(commands, "render", "draw one picture of a scene")
    add_value(command, "scene SCENE", Path)
    add_output(command, "IMG", "the .png to write")
    add_camera(command)
    usual = (pictures.RGB, pictures.RGB.word, None)
    add_value(command, f"--what {'|'.join(pictures.WORDS)}", what, "(default: rgb)", default=usual)
    told = "phrases for relevance (one) and labels (any number)"
    add_value(command, "--prompt PHRASE", str, told, nargs="+")
    add_shown(command)
    add_colours(command)
    add_axes(command)
    add_backend(command)
    add_json(command)


def add_export(commands) -> None:
    """`langflash export`."""
    purpose = "write a scene, or what a phrase finds, as a file for other programs"
    command = new_command(commands, "export", purpose)
    add_value(command, "scene SCENE", Path)
    add_output(command, "FILE", help_of_files())
    told = "keep only what these find; in an .html they are shown as asked"
    add_value(command, "--prompt PHRASE", str, told, nargs="+")
    add_value(command, "--threshold T", kept_fraction, "keep what scores at least T, between 0 and 1")
    command.add_argument("--what", choices=WORDS, help=help_of_words())
    add_switch(
        command,
        "--segmented",
        "write a folder: masks, soft masks, cut-outs and instances of --prompt and depth for every "
        "photo, boxes, surfaces, a contact sheet and manifest.json",
    )
    add_colours(command)
    add_switch(command, "--all-views", "one file per photo: FILE_1, FILE_2 and so on")
    add_switch(command, "--with-text", "an .html answers any phrase; adds 28 MB")
    told = "add other scenes to the same .html; they are asked the same phrases"
    add_value(command, "--beside SCENE", Path, told, nargs="+", default=())
    command.add_argument(
        "--detail",
        choices=EXPORT_DETAILS,
        default=EXPORT_DETAILS[0],
        help="low keeps only coarse Gaussians, for small files and slow machines; in a scene without levels "
        f"it keeps a third, made wider (default: {EXPORT_DETAILS[0]})",
    )
    add_switch(
        command,
        "--upright",
        "write Gaussians and poses level, on the floor and turned north, as `langflash level` found, in "
        "metres if they are known",
    )
    add_value(command, "--seconds S", film_seconds, "length of a video (default: 6)")
    add_value(
        command,
        "--path WAY",
        str,
        "how a video moves: photos, from one to the next and back (default); orbit, around the scene; "
        "tour, along the scene's stops; or a JSON list of cameras as for --camera, each with its time in "
        "seconds, or evenly spread",
    )
    told = "also replace a .json of another kind, and files named like a legend or a COCO picture"
    add_switch(command, "--replace", told)
    add_camera(command)
    add_shown(command)
    add_axes(command, written=True)
    add_backend(command)


def add_lift(commands) -> None:
    """`langflash lift`."""
    command = new_command(commands, "lift", "make a plain splat file answer phrases")
    add_value(command, "scene SCENE", Path, "a splat file, or a scene to teach again")
    add_output(command, "SCENE", "the .langflash to write, or a .ply or .glb with its language")
    told = "photos of the place, with --poses (default: views of the splats themselves)"
    add_value(command, "--photos PHOTO", Path, told, nargs="+")
    add_value(command, "--poses PATH", Path, "transforms.json, or a COLMAP model")
    command.add_argument(
        "--up",
        choices=("x", "y", "z", "-x", "-y", "-z"),
        default="-y",
        metavar="AXIS",
        help="the axis that points up, for views of the splats themselves: z, or --up=-z and so on "
        "(default: -y)",
    )
    add_value(command, "--weights PATH", Path, "use this checkpoint instead of the shipped ones")
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
    add_value(command, "scene SCENE", Path)
    add_value(command, "prompts PHRASE", str, 'such as "person", "picture", "screen"', nargs="+")
    add_output(command, "SCENE", "the .langflash to write")
    told = f"blurred, as large pixels, or not at all (default: {HOWS[0]})"
    command.add_argument("--how", choices=HOWS, default=HOWS[0], help=told)
    told = "for blur and pixels: blocks along the longest side of the largest thing, 1 to 16 (default: 6)"
    add_value(command, "--blocks N", above_zero, told)
    told = "hide this much around it too, as a share of a photo's longer side (default: 0.02)"
    add_value(command, "--margin SHARE", share, told)
    add_value(command, "--threshold T", kept_fraction, "hide what scores at least T, between 0 and 1")
    told = "for remove: leave the hole open instead of filling it from what is around it"
    add_switch(command, "--open", told)
    told = "photos in the file: painted over where they show it, or left out (default: painted)"
    command.add_argument("--photos", choices=("painted", "none"), default="painted", help=told)
    add_value(command, "--preview IMG", Path, "a .png: what is hidden, in red, and after")
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
    add_value(command, "scene SCENE", Path)
    add_output(command, "SCENE", "the .langflash to write")
    add_value(command, "--strength T", share, "how much to remove, 0 to 1 (default: 0.5 without other rules)")
    command.add_argument(
        "--kinds", nargs="+", choices=KINDS, metavar="KIND", help=f"remove {', '.join(KINDS)} (default: all)"
    )
    add_value(command, "--where RULE", str, "also remove what meets all of one of these rules", nargs="+")
    add_value(command, "--within PHRASE", str, "only within what these find", nargs="+")
    add_switch(command, "--invert", "remove the rest instead")
    told = "keep only what is inside: core, room, or --crop=X,Y,Z,X,Y,Z, low and high corner"
    add_value(command, "--crop BOX", str, told)
    add_value(command, "--recipe FILE", Path, "read all of these settings from a file")
    add_value(command, "--save-recipe FILE", Path, "save these settings as a .json, for other scenes")
    add_switch(command, "--fill", "fill what was removed from what is around it")
    add_value(command, "--preview IMG", Path, "write a .png: what goes, in red, and after")
    add_axes(command)
    add_backend(command)
    add_json(command)


def add_level(commands) -> None:
    """`langflash level`."""
    purpose = "find which way is up, the floor, north and the likely scale"
    command = new_command(commands, "level", purpose)
    add_value(command, "scene SCENE", Path)
    add_output(command, "SCENE", "write the scene with it (default: only print it)", required=False)
    add_value(command, "--up X,Y,Z", spot, "this way is up, in the scene's own axes")
    add_value(command, "--north X,Y,Z", spot, "this way is north")
    add_value(command, "--origin X,Y,Z", spot, "this point lies at 0, on the floor")
    lengths = command.add_mutually_exclusive_group()
    lengths.add_argument(
        "--length",
        nargs=3,
        metavar=("A", "B", "METRES"),
        help="the distance from A to B; both are points X,Y,Z of the scene, or pixels PHOTO:U,V of a photo "
        "as the scene has it, photos counted from 1",
    )
    add_value(lengths, "--ceiling METRES", above_zero, "the height of the ceiling")
    add_value(lengths, "--door METRES", above_zero, "the height of the door")
    add_axes(command)
    add_json(command)


def add_inventory(commands) -> None:
    """`langflash inventory`."""
    purpose = "list what is in a room, with size, place and certainty; or what changed since another scene"
    command = new_command(commands, "inventory", purpose)
    add_value(command, "scene SCENE", Path)
    add_output(
        command,
        "FILE",
        ".html: a page to print, with cut-outs and a plan; .csv, .json: the list; .svg, .dxf: the floor "
        "plan, to scale; .langflash: the scene with the names of --name",
        required=False,
        nargs="+",
    )
    told = "your own name for a thing; nothing after = removes it"
    command.add_argument("--name", nargs="+", metavar='"CHAIR 1=NAME"', help=told)
    add_value(
        command, "--beside SCENE", Path, "a later scene of the same room: list what came, went and moved"
    )
    add_value(command, "--threshold T", kept_fraction, "list things that score at least T, from 0 to 1")
    add_backend(command)
    add_json(command)


def add_info(commands) -> None:
    """`langflash info`."""
    command = new_command(commands, "info", "show what a scene file holds, and what pruning saved")
    add_value(command, "scene SCENE", Path, ".langflash or a splat file", nargs="?")
    add_switch(command, "--sbom", "list what is installed, as a bill of materials (CycloneDX JSON)")
    add_switch(command, "--limits", "list how large files may be, and the variables that change it")
    add_axes(command)
    add_json(command)


def add_words(commands) -> None:
    """`langflash words`."""
    actions = new_actions(commands, "words", "save the names taught in some scenes, and teach them to others")
    learn = new_command(actions, "learn", "save the names and denials of scenes as a vocabulary")
    add_value(learn, "scenes SCENE", Path, "scenes whose groups have names", nargs="+")
    add_output(learn, "FILE", "the vocabulary, .words.json; an existing one is added to")
    add_json(learn)
    teach = new_command(actions, "teach", "name the groups of a scene from a vocabulary")
    add_value(teach, "scene SCENE", Path)
    add_value(teach, "words FILE", Path, "the vocabulary")
    add_output(teach, "SCENE", "the scene to write")
    add_json(teach)
    listing = new_command(actions, "list", "list what a vocabulary holds")
    add_value(listing, "words FILE", Path, "the vocabulary")
    add_json(listing)


def add_weights(commands) -> None:
    """`langflash weights`."""
    actions = new_actions(commands, "weights", "list, download and check the checkpoints of the networks")
    told = "name, size and origin of each checkpoint, and which can be downloaded"
    add_json(new_command(actions, "list", told))
    told = "download a published checkpoint and convert it; continues where it stopped"
    get = new_command(actions, "get", told)
    add_value(get, "name NAME", str, "a name from `langflash weights list`")
    add_switch(get, "--keep", "keep the file as it was downloaded")
    add_json(get)
    imported = new_command(actions, "import", "convert a published checkpoint that is already here")
    add_value(imported, "path PATH", Path, ".ckpt, .pt or .safetensors")
    imported.add_argument("--preset", choices=("full",), default="full", help="(default: full)")
    told = "(default: the cache folder, where it is looked for)"
    add_output(imported, "FILE", told, required=False)
    told = "the photo size that it was trained on, PX x PX (default: from its published name)"
    add_value(imported, "--size PX", pixel_side, told)
    add_json(imported)
    verify = new_command(actions, "verify", "read every number and check that it fits its network")
    add_value(verify, "paths PATH", Path, "checkpoints (default: the shipped ones)", nargs="*")
    add_json(verify)
