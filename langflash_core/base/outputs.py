"""Every kind of file that is written, one record each: what all who offer, check, name or write it go by.

API, command line, batch and window read this table; so do help texts, the export dialog, the names that it
predicts and the tests. A writer is named, `module:function` below `langflash_core`, and imported when it is
wanted, so the table is read without torch. Those of `of_scene`, `of_frame` and `of_answer` are called with
the subject and the path; that of `writer` with a `writing.job.Job`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from langflash_core.base.formats import COMPRESSED_PLY, SOG_FOLDER, USD, kind_of

Subject = Literal["view", "answers", "film", "scene", "page", "photos", "room", "folder"]
Phrases = Literal["none", "narrow", "show", "some", "one"]

_HOLDS = {
    "view": "a view",
    "answers": "what answers --prompt",
    "film": "a film",
    "scene": "Gaussians",
    "page": "a web page that shows the scene and answers phrases",
    "photos": "photos and their poses",
    "room": "what is in the room, or its plan",
    "folder": "every photo's view taken apart by --prompt",
}  # of subjects, for help


@dataclass(frozen=True, eq=False)
class Output:
    """One kind of file.

    name: of this record alone; ends the file's name that the window proposes, unless `stem` does. endings: of
    its files; the window proposes the first; a folder has "". label, tip: on the window's button and under
    it; without a label it is not offered there. word: for `--what`. unsaid: it is also what an ending stands
    for where `--what` is not said. noun: what it is called there.

    phrases: "none" are taken; they "narrow" it down to what answers, if there are some; "show" makes them
    shown as asked; "some" or "one" are needed. looks: it is seen from a camera. each: with --all-views a
    file a view. moves: it is a film. fades: it shows colours, which may fade where no photo looked. fills:
    gaps in them may be filled. colours: by a colour map. every: it is of all photos' views, unless one is
    named.

    beside: name of what is written beside each file, with its `{stem}`; with `{photo}`, a file a view. keys:
    of a .json of this kind, in its object or in every entry of its list.
    """

    name: str
    endings: tuple[str, ...]
    label: str = ""
    tip: str = ""
    subject: Subject = "view"
    word: str = ""
    unsaid: bool = False
    noun: str = ""
    stem: str = ""
    phrases: Phrases = "none"
    looks: bool = False
    each: bool = False
    moves: bool = False
    fades: bool = False
    fills: bool = False
    colours: bool = False
    every: bool = False
    beside: str = ""
    keys: tuple[str, ...] = ()
    writer: str = "writing.scenes:write_scene"
    of_scene: str = ""
    of_frame: str = ""
    of_answer: str = ""
    reader: str = ""

    @property
    def suffix(self) -> str:
        """What a file that the window proposes ends in; "" for a folder."""
        return self.endings[0]

    @property
    def ends(self) -> str:
        """What a proposed name ends with, before the suffix, so that no kind takes another's."""
        return f"_{self.stem or self.name}"

    @property
    def needs_phrases(self) -> bool:
        """Whether there is nothing to write without a phrase."""
        return self.phrases in ("some", "one")

    @property
    def takes_phrases(self) -> bool:
        """Whether phrases may narrow it down. A page holds everything and shows them as asked."""
        return self.phrases == "narrow" or self.needs_phrases

    @property
    def splats(self) -> bool:
        """Whether Gaussians are written, not pictures of them."""
        return self.subject in ("scene", "page")

    @property
    def sized(self) -> bool:
        """Whether it has a size in pixels."""
        return self.looks or self.moves

    def files(self, target: Path, photos: int | None) -> tuple[Path, ...]:
        """What is written for `target`: its own files, and what lies beside them.

        Args:
            photos: how many, where all of their views are written; None: one view.
        """
        own = self.own_files(target, photos)
        return (*own, *(beside for file in own for beside in self.files_beside(file, photos)))

    def own_files(self, target: Path, photos: int | None) -> tuple[Path, ...]:
        """`target`, or its file of each photo; `photos` as `files`."""
        if photos is None or not self.each:
            return (target,)
        return tuple(
            target.with_name(f"{target.stem}_{number}{target.suffix}") for number in range(1, photos + 1)
        )

    def files_beside(self, file: Path, photos: int | None) -> tuple[Path, ...]:
        """What lies beside one of its own files; `photos` as `files`."""
        count = (photos or 1) if "{photo}" in self.beside else int(bool(self.beside))
        numbers = range(1, count + 1)  # as people count photos
        return tuple(file.with_name(self.beside.format(stem=file.stem, photo=number)) for number in numbers)


def _splats(name: str, endings: tuple[str, ...], writer: str, reader: str, **more: Any) -> Output:
    """A file of Gaussians, which phrases narrow down."""
    return Output(name, endings, subject="scene", phrases="narrow", of_scene=writer, reader=reader, **more)


RGB = Output(
    "picture", (".png",), "Picture", "The scene's colours, PNG",
    word="rgb", unsaid=True, looks=True, each=True, fades=True, fills=True,
    writer="writing.views:write_pictures", of_frame="export.png:write_frame",
)  # fmt: skip
HEAT = Output(
    "heat", (".png",), "Heat-map", "Where the active phrase fits, over the colours",
    word="heat", phrases="one", looks=True, each=True, fills=True, colours=True,
    writer="writing.views:write_pictures", of_answer="export.png:write_answer",
)  # fmt: skip
MASK = Output(
    "mask", (".png",), "Mask", "White where any phrase is found",
    word="mask", phrases="some", looks=True, each=True, writer="writing.views:write_pictures",
)  # fmt: skip
SOFT = Output(
    "soft", (".png",), "Soft mask", "How much of each pixel belongs to any phrase, 16-bit grey",
    word="soft", phrases="some", looks=True, each=True, writer="writing.parts:write_parts",
)  # fmt: skip
CUTOUT = Output(
    "cutout", (".png",), "Cut-out", "What the phrases find, on a transparent background (RGBA)",
    word="cutout", unsaid=True, phrases="some", looks=True, each=True, writer="writing.parts:write_parts",
)  # fmt: skip
LABELS = Output(
    "labels", (".png",), "Label map", "Phrase numbers as a palette PNG, and a legend as JSON",
    word="labels", phrases="some", looks=True, each=True, beside="{stem}.json",
    writer="writing.views:write_pictures",
)  # fmt: skip
INSTANCES = Output(
    "instances", (".png",), "Instances",
    "One number per connected thing (three chairs are three), and a legend",
    word="instances", phrases="some", looks=True, each=True, beside="{stem}.json",
    writer="writing.parts:write_parts",
)  # fmt: skip
DEPTH = Output(
    "depth", (".png",), "Depth", "16-bit PNG; the length of one step is in the file",
    word="depth", looks=True, each=True, writer="writing.views:write_depth",
)  # fmt: skip
DEPTH_EXR = Output(
    "depth_exr", (".exr",), tip="32-bit floats", word="depth", unsaid=True, noun="an .exr of depth",
    looks=True, each=True, writer="writing.views:write_depth",
)  # fmt: skip
SEGMENTED = Output(
    "segmented", ("",), "All of it, folder",
    "Masks, cut-outs, instances, depth, boxes, surfaces, a contact sheet and a manifest",
    subject="folder", phrases="some", looks=True, every=True, writer="writing.segmented:write_segmented",
)  # fmt: skip
COCO = Output(
    "coco", (".json",), "COCO masks", "Instance masks as COCO JSON, and the pictures they belong to",
    subject="answers", noun="a .json of masks", phrases="some", looks=True, every=True,
    beside="{stem}_{photo}.png", keys=("images", "annotations"),
    writer="writing.views:write_coco_masks", of_answer="export.coco:write_answer",
)  # fmt: skip
BOXES_JSON = Output(
    "boxes", (".json",), "Boxes, JSON", "Place, axes and size of what each phrase finds",
    subject="answers", word="boxes", phrases="some", looks=True, keys=("prompt", "box"),
    writer="writing.boxes:write_boxes",
)  # fmt: skip
BOXES_CSV = Output(
    "boxes_table", (".csv",), "Boxes, CSV", "The same as a table",
    subject="answers", word="boxes", unsaid=True, noun="a .csv of boxes", phrases="some", looks=True,
    writer="writing.boxes:write_boxes",
)  # fmt: skip
BOXES_GLB = Output(
    "boxes_bodies", (".glb",), "Boxes, .glb", "The same as boxes, for Blender and other 3D programs",
    subject="answers", word="boxes", phrases="some", looks=True,
    writer="writing.boxes:write_boxes", of_answer="export.glb:write_answer",
)  # fmt: skip
SURFACE = Output(
    "surfaces", (".glb",), "Surfaces, .glb", "A coloured mesh of what each phrase finds, fused from depth",
    subject="answers", word="surface", phrases="some", writer="writing.parts:write_surface",
)  # fmt: skip
NUMBERS = Output(
    "numbers", (".npz",), tip="The view as arrays: colour, depth, weight maps; or relevance and masks",
    phrases="narrow", looks=True, writer="writing.views:write_numbers", of_answer="export.npz:write_npz",
)  # fmt: skip
VIDEO = Output(
    "film", (".mp4",), "Film, .mp4", "A film around it, past the photos or along key frames, H.264",
    subject="film", phrases="narrow", moves=True, fades=True, fills=True, writer="writing.films:write_film",
)  # fmt: skip
WEBP = Output(
    "film_webp", (".webp",), "Film, .webp", "The same as an animated picture, for pages and messages",
    subject="film", stem="film", phrases="narrow", moves=True, fades=True, fills=True,
    writer="writing.films:write_film",
)  # fmt: skip
HEAT_VIDEO = Output(
    "heat_film", (".mp4", ".webp"), "Film, heat-map", "The film with the active phrase's heat-map, H.264",
    subject="film", word="heat", phrases="one", moves=True, fades=True, fills=True, colours=True,
    writer="writing.films:write_film",
)  # fmt: skip
PLY = _splats(
    "ply", (".ply",), "export.ply:write_ply", "export.compressed_ply:read_any_ply",
    label="Splats, .ply", tip="3D Gaussians as other viewers read them", stem="splats",
    beside="{stem}.language.safetensors",
)  # fmt: skip
COMPRESSED = _splats(
    "compressed_ply", (COMPRESSED_PLY,), "export.compressed_ply:write_compressed_ply", "",
)  # fmt: skip
SPZ = _splats(
    "spz", (".spz",), "export.spz:write_spz", "export.spz:read_spz",
    label="Splats, .spz", tip="Compressed, for phones and the web", stem="splats",
)  # fmt: skip
SOG = _splats(
    "sog", (".sog", SOG_FOLDER), "export.sog:write_sog", "export.sog:read_sog",
    label="Splats, .sog", tip="Compressed as pictures, for SuperSplat and PlayCanvas", stem="splats",
    keys=("means",),
)  # fmt: skip
SPLAT = _splats(
    "splat", (".splat",), "export.splat:write_splat", "export.splat:read_splat",
    label="Splats, .splat", tip="The compact format of older web viewers", stem="splats",
)  # fmt: skip
GLB = _splats(
    "glb", (".glb",), "export.gltf:write_glb", "export.gltf:read_gltf",
    label="Splats, .glb", tip="3D Gaussians in glTF, with what they mean", stem="splats",
)  # fmt: skip
OPEN_USD = _splats("usd", USD, "export.usd:write_usd", "export.usd:read_usd")
PAGE = Output(
    "page", (".html",), "Web page",
    "One HTML file to fly through and ask in any browser, even offline",
    subject="page", phrases="show", writer="writing.scenes:write_page", of_scene="export.html:write_html",
)  # fmt: skip
SCENE = _splats(
    "langflash", (".langflash",), "scene.file:save", "scene.file:load",
    label="Scene", tip="All of it with language and photos, for this program", stem="copy",
)  # fmt: skip
COLMAP = Output(
    "colmap", ("cameras.txt",), tip="COLMAP's text model", subject="photos", phrases="narrow",
    of_scene="export.cameras:write_colmap",
)  # fmt: skip
TRANSFORMS = Output(
    "transforms", ("transforms.json",), tip="For nerfstudio and others", subject="photos", phrases="narrow",
    keys=("frames",), of_scene="export.cameras:write_transforms",
)  # fmt: skip

INVENTORY_PAGE = Output(
    "inventory", (".html",), "Page", tip="What is in the room, with cut-outs and a plan, as a page to print",
    subject="room", word="inventory", writer="writing.inventory:write_inventory",
)  # fmt: skip
INVENTORY_CSV = Output(
    "inventory_table", (".csv",), "Table, .csv", stem="inventory", tip="What is in the room as a table",
    subject="room", word="inventory", noun="a .csv of things", writer="writing.inventory:write_inventory",
)  # fmt: skip
INVENTORY_JSON = Output(
    "inventory_data", (".json",), "Data, .json", stem="inventory",
    tip="What is in the room, and its plan, as data", subject="room",
    word="inventory", keys=("things",), writer="writing.inventory:write_inventory",
)  # fmt: skip
PLAN_SVG = Output(
    "plan", (".svg",), "Plan, .svg",
    tip="The room from above, to scale, with walls, things, names and measures",
    subject="room", word="plan", unsaid=True, writer="writing.inventory:write_plan",
)  # fmt: skip
PLAN_DXF = Output(
    "plan_cad", (".dxf",), "Plan, .dxf", stem="plan", tip="The same for CAD programs",
    subject="room", word="plan", unsaid=True, writer="writing.inventory:write_plan",
)  # fmt: skip

OUTPUTS = (
    RGB, HEAT, MASK, SOFT, CUTOUT, LABELS, INSTANCES, DEPTH, DEPTH_EXR, SEGMENTED, COCO, BOXES_JSON,
    BOXES_CSV, BOXES_GLB, SURFACE, NUMBERS, VIDEO, WEBP, HEAT_VIDEO, PLY, COMPRESSED, SPZ, SOG, SPLAT, GLB,
    OPEN_USD, PAGE, SCENE, COLMAP, TRANSFORMS, INVENTORY_PAGE, INVENTORY_CSV, INVENTORY_JSON, PLAN_SVG,
    PLAN_DXF,
)  # fmt: skip
OFFERED = tuple(output for output in OUTPUTS if output.label and output.subject != "room")
"""By the window's export, in the order of its buttons."""
ROOM = tuple(output for output in OUTPUTS if output.subject == "room")
"""By the window's inventory."""
WORDS = tuple(dict.fromkeys(output.word for output in OUTPUTS if output.word))
"""For `--what`."""
READ_ONLY = {".ksplat": "export.ksplat:read_ksplat", ".gltf": "export.gltf:read_gltf"}


def _endings(chosen: Callable[[Output], object]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(end for output in OUTPUTS if chosen(output) for end in output.endings if end))


ALL_OUT = _endings(lambda output: True)
"""What `langflash export` writes."""
SCENES_OUT = _endings(lambda output: output.subject == "scene")
READERS = {end: output.reader for output in OUTPUTS if output.reader for end in output.endings} | READ_ONLY
SCENES_IN = tuple(READERS)
DROPPED = tuple(kind for kind in SCENES_IN if kind.startswith("."))  # a meta.json may be anything


def output_of(target: Path, what: str | None, asked: bool) -> Output | None:
    """What a file is to hold, by its name, the word of `--what`, and whether phrases are asked; None where
    nothing fits."""
    ending = kind_of(target)
    fitting = [output for output in OUTPUTS if ending in output.endings and ending]
    if what is not None:
        return next((output for output in fitting if output.word == what), None)
    unsaid = [output for output in fitting if output.unsaid or not output.word]
    wanted = [output for output in unsaid if asked == output.needs_phrases or output.phrases == "narrow"]
    return next(iter(wanted or unsaid), None)


def endings_of(word: str) -> tuple[str, ...]:
    """Of the files that hold what `--what` says."""
    return _endings(lambda output: output.word == word)


def help_of_files() -> str:
    """What the ending of -o says, for `--help`."""
    parts = []
    for subject, holds in _HOLDS.items():
        endings = _endings(lambda output, own=subject: output.subject == own and not output.word)
        endings += _endings(lambda output, own=subject: output.subject == own and output.unsaid)
        if endings:
            parts.append(f"{', '.join(dict.fromkeys(endings))}: {holds}")
    return f"with --segmented a folder; else {'; '.join(parts)}"


def help_of_words() -> str:
    """What the words of `--what` mean, for `--help`."""
    firsts = {word: next(output for output in OUTPUTS if output.word == word) for word in WORDS}
    said = (f"{word} ({' '.join(endings_of(word))}): {output.tip}" for word, output in firsts.items())
    return f"{'; '.join(said)}; without it a .png is a picture, or, with --prompt, a cut-out"


def import_reference(reference: str) -> Callable[..., Any]:
    """What a record names, imported now."""
    module, _, function = reference.partition(":")
    return getattr(import_module(f"langflash_core.{module}"), function)
