"""What to write, as the export dialog has it, and the export under way."""

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from langflash_core.formats import FILMS_OUT, PAGE_OUT, SCENES_OUT

LARGEST_SIDE = 8192  # pixels, as on the command line
SECONDS = (1.0, 60.0)


class What(Enum):
    """What to write: the label of the choice, the ending, the word for `--what`, and the one that ends the
    name of its file, so that no kind takes another's."""

    RGB = ("Picture", ".png", "rgb", "picture")
    HEAT = ("Heat-map", ".png", "heat", "heat")
    MASK = ("Mask", ".png", "mask", "mask")
    SOFT = ("Soft mask", ".png", "soft", "soft")
    CUTOUT = ("Cut-out", ".png", "cutout", "cutout")
    LABELS = ("Label map", ".png", "labels", "labels")
    INSTANCES = ("Instances", ".png", "instances", "instances")
    DEPTH = ("Depth", ".png", "depth", "depth")
    SEGMENTED = ("All of it, folder", "", "", "segmented")
    COCO = ("COCO masks", ".json", "", "coco")
    BOXES_JSON = ("Boxes, JSON", ".json", "boxes", "boxes")
    BOXES_CSV = ("Boxes, CSV", ".csv", "boxes", "boxes_table")
    BOXES_GLB = ("Boxes, .glb", ".glb", "boxes", "boxes_bodies")
    SURFACE = ("Surfaces, .glb", ".glb", "surface", "surfaces")
    VIDEO = ("Film, .mp4", ".mp4", "", "film")
    WEBP = ("Film, .webp", ".webp", "", "film")
    HEAT_VIDEO = ("Film, heat-map", ".mp4", "heat", "heat_film")
    PLY = ("Splats, .ply", ".ply", "", "splats")
    SPZ = ("Splats, .spz", ".spz", "", "splats")
    SOG = ("Splats, .sog", ".sog", "", "splats")
    SPLAT = ("Splats, .splat", ".splat", "", "splats")
    GLB = ("Splats, .glb", ".glb", "", "splats")
    PAGE = ("Web page", ".html", "", "page")
    SCENE = ("Scene", ".langflash", "", "copy")

    @property
    def label(self) -> str:
        return self.value[0]

    @property
    def suffix(self) -> str:
        return self.value[1]

    @property
    def word(self) -> str:
        return self.value[2]

    @property
    def ends(self) -> str:
        """What a file's name ends with, before the ending."""
        return f"_{self.value[3]}"

    @property
    def needs_phrases(self) -> bool:
        """Whether there is nothing to write without a phrase."""
        return self in (
            What.HEAT, What.HEAT_VIDEO, What.MASK, What.SOFT, What.CUTOUT, What.LABELS, What.INSTANCES,
            What.SEGMENTED, What.COCO, What.BOXES_JSON, What.BOXES_CSV, What.BOXES_GLB, What.SURFACE,
        )  # fmt: skip

    @property
    def of_one_phrase(self) -> bool:
        """Whether it shows the active phrase alone."""
        return self in (What.HEAT, What.HEAT_VIDEO)

    @property
    def takes_phrases(self) -> bool:
        """Whether phrases may narrow it down. A page holds everything and shows them as asked."""
        return self not in (What.RGB, What.DEPTH, What.PAGE)

    @property
    def looks(self) -> bool:
        """Whether it is seen from a camera."""
        return not (self.film or self.splats or self is What.SURFACE)

    @property
    def film(self) -> bool:
        """Whether it moves, and has a length."""
        return self.suffix in FILMS_OUT

    @property
    def splats(self) -> bool:
        """Whether Gaussians are written, not pictures of them."""
        return not self.word and self.suffix in (*SCENES_OUT, PAGE_OUT)

    @property
    def fades(self) -> bool:
        """Whether it shows colours, which may fade where no photo looked."""
        return self.film or self is What.RGB

    @property
    def fills(self) -> bool:
        """Whether it shows colours to look at, whose gaps are filled as on show."""
        return self.film or self in (What.RGB, What.HEAT)

    @property
    def sized(self) -> bool:
        """Whether it has a size in pixels."""
        return self.looks or self.film


@dataclass(frozen=True)
class ExportForm:
    """all_views: from every photo instead of the view on show. only_found: just what answers the
    phrases. only_selected: just the selection, where Gaussians are written. side: the longer one in
    pixels. fade: leave out what no photo looked at; None: as the window does. way: of a film, of
    `filming.state.WAYS`; empty: `order.way`. path: as typed; an ending is added. proposed: the path that
    nobody has typed. serial: of the scene that `path` is for."""

    what: What = What.RGB
    all_views: bool = False
    only_found: bool = False
    only_selected: bool = False
    side: int = 1024
    seconds: float = 6.0
    fade: bool | None = None
    way: str = ""
    path: str = ""
    proposed: str = ""
    serial: int = 0


@dataclass(frozen=True)
class Running:
    """An export under way. fraction: 0 to 1, below 0 while nothing is known."""

    target: Path
    stage: str = "starting"
    fraction: float = -1.0
    cancelling: bool = False


NO_FORM = ExportForm()


@dataclass(frozen=True)
class Exporting:
    """The exporting half of the state. edited, selection: copies that an export reads, of the scene
    with unsaved edits and of what is selected. there: files that it would replace, while it is asked."""

    form: ExportForm = NO_FORM
    running: Running | None = None
    edited: Path | None = None
    selection: Path | None = None
    there: tuple[Path, ...] = ()


NO_EXPORTING = Exporting()
