"""What editing adds to the state: the tool in hand, the history, what the pointer found."""

from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from pathlib import Path

import numpy as np

from langflash_core.geometry.poses import Pose
from langflash_core.mending.recipes import Box, Recipe
from langflash_core.mending.settings import RECIPE_DEFAULTS
from langflash_core.scene.changes import Change
from langflash_core.scene.edits import Combine, History, Marks
from langflash_core.scene.mask import Mask

RADIUS_RANGE = (4.0, 160.0)  # design pixels
PICK_RADIUS = 4.0
REACH_RANGE = (1.0, 12.0)
TOP_ATOMS = 3
RECIPE_SUFFIX = ".recipe.json"
BY_STRENGTH = Recipe(RECIPE_DEFAULTS.strength)


class Tool(Enum):
    """What the left button does on the picture; the value is the name for people."""

    MOVE = "Move"
    POINT = "What is this?"
    BOX = "Box"
    LASSO = "Lasso"
    BRUSH = "Brush"
    SPHERE = "Sphere"
    PICK = "Thing"
    PLACE = "Place"
    RULER = "Ruler"
    CLONE = "Clone"

    @property
    def selects(self) -> bool:
        return self in (Tool.BOX, Tool.LASSO, Tool.BRUSH, Tool.SPHERE, Tool.PICK)


class Handle(Enum):
    """What the gizmo does with the selection; the value is the name for people."""

    MOVE = "Move"
    TURN = "Turn"
    SCALE = "Scale"


@dataclass(frozen=True)
class Tint:
    """A colour in [0, 1] and how much of it, 0 to 1."""

    colour: tuple[float, float, float] = (0.80, 0.24, 0.18)
    strength: float = 0.8


Point = tuple[float, float]
Spot = tuple[float, float, float]


@dataclass(frozen=True)
class Region:
    """Pixels of the picture's place: a box between its first and last point, a brushed line, or what a line
    goes around.

    points: x, y in framebuffer pixels. radius: of the brush, None for the others. around: the points are
    corners, and the last is joined with the first.
    """

    points: tuple[Point, ...]
    radius: float | None = None
    around: bool = False

    def pixels(self, width: int, height: int, scale: float = 1.0) -> np.ndarray:
        """(height, width) bool: pixels whose centre lies inside, points and radius times `scale`."""
        path = np.array(self.points, float) * scale
        inside = np.zeros((height, width), bool)
        if self.around:
            return _inside_of(path, width, height)
        if self.radius is None:
            (x0, y0), (x1, y1) = path[[0, -1]].min(0), path[[0, -1]].max(0)
            columns, rows = np.arange(width) + 0.5, np.arange(height) + 0.5
            inside[np.ix_((rows >= y0) & (rows <= y1), (columns >= x0) & (columns <= x1))] = True
            return inside
        for start, end in zip(path, path[1:] if len(path) > 1 else path, strict=False):
            _stroke(inside, start, end, self.radius * scale)
        return inside

    @property
    def what(self) -> str:
        """For the list of edits."""
        if self.radius is None:
            return "in a lasso" if self.around else "in a box"
        return "with the brush"


@dataclass(frozen=True)
class Reading:
    """What one pixel of the picture shows. at: framebuffer pixels of the picture's place.

    point: world, scene units; None where nothing is. atoms: (atom, share), most first; None while
    the weight maps of this view are not drawn.
    """

    at: Point
    point: tuple[float, float, float] | None = None
    depth: float = 0.0
    atoms: tuple[tuple[int, float], ...] | None = None


@dataclass(frozen=True)
class Card:
    """The answer to "what is this?". words: (word, score as of a phrase), None while they are looked up.

    vector: F(p) as float32 bytes, for "find similar".
    """

    reading: Reading
    words: tuple[tuple[str, float], ...] | None = None
    vector: bytes = field(default=b"", repr=False)


@dataclass(frozen=True)
class Reached:
    """What was clicked last: levels of it, the smallest first, and the one that is selected.

    before, after: the history without and with that.
    """

    levels: tuple[Mask, ...] = field(repr=False)
    level: int
    combine: Combine
    before: History = field(repr=False)
    after: History = field(repr=False)


@dataclass(frozen=True)
class Outline:
    """Closed lines around what the picture shows of a selection, framebuffer pixels of its place.

    of: the selection. pose, size: where it is seen from, and of the picture's place.
    """

    lines: tuple[tuple[Point, ...], ...] = field(repr=False)
    of: Mask = field(repr=False)
    pose: Pose
    size: tuple[int, int]


@dataclass(frozen=True)
class Floaters:
    """The preview of what a recipe takes away: floaters, sheets, flyaways and crumbs, and what rules say.

    least: (N,) float32 bytes, the strength from which each goes; empty while computed. within: only of these;
    None: of all. ruled, answering, outside: what meets a rule, what answers the recipe's phrases, what is
    outside its box; None where it says nothing of that. box: the corners of its box. open: rules are shown.
    """

    least: bytes = field(default=b"", repr=False)
    recipe: Recipe = BY_STRENGTH
    within: Mask | None = None
    ruled: Mask | None = None
    answering: Mask | None = None
    outside: Mask | None = None
    box: Box | None = None
    open: bool = False

    @property
    def strength(self) -> float:
        return self.recipe.strength

    @property
    def by_rules(self) -> bool:
        """Whether more than the strength decides."""
        return self.recipe != Recipe(self.strength)

    def mask(self, visible: Mask) -> Mask:
        """Gaussians that go, of what is shown, by `langflash_core.mending.cleaning.apply_recipe`."""
        found = Mask.none(visible.count)
        if not self.least or self.recipe.empty:
            return found
        scope = visible
        for limit in (self.within, self.answering):
            scope = scope if limit is None else scope & limit
        if self.strength:
            found = self._weak
        found = scope & (found if self.ruled is None else found | self.ruled)
        found = scope - found if self.recipe.invert else found
        return found if self.outside is None else found | (visible & self.outside)

    @cached_property
    def _weak(self) -> Mask:
        """What goes by its strength alone; every frame of the preview asks."""
        return _up_to(self.least, self.strength)


@dataclass(frozen=True)
class Hiding:
    """How the selection is to be hidden for good, while that is asked.

    margin: around it in photos, of their longer side. least: (N,) float32 bytes, the margin from which on
    each Gaussian is hidden with it; of: the marks that this was found for, None while it is computed.
    """

    how: str
    margin: float = RECIPE_DEFAULTS.margin
    least: bytes = field(default=b"", repr=False)
    of: Marks | None = field(default=None, repr=False)

    def mask(self, marks: Marks) -> Mask | None:
        """Gaussians that are hidden, as `langflash_core.mending.hiding.hide` finds them; None: not known
        yet."""
        return self._near if self.of == marks else None

    @cached_property
    def _near(self) -> Mask:
        """What the margin hides; every frame of the preview asks."""
        return _up_to(self.least, self.margin)


def _up_to(least: bytes, most: float) -> Mask:
    """Gaussians whose number, of (N,) float32 bytes, is not above the most."""
    return Mask.of(np.frombuffer(least, np.float32) <= most)


THINGS = "Finding things"
"""What a click waits for that takes a thing: the first one in a scene, some seconds."""


@dataclass(frozen=True)
class Editing:
    """The editing half of the state.

    saved: the marks that the file on disk holds; None when it holds none of these.
    radius: of the brush, design pixels. reach: of growing, in spacings of the Gaussians.
    drag: the region being drawn, framebuffer pixels. waiting: what the worker is looking for.
    searched: how much of the scene it went through for things, of 1.
    hover: what is under the pointer. asked: where a click waits for the picture to rest.
    names: nearest words of each atom, best first; found: the best of them that are found when asked.
    ruler: the ends of what is measured, world.
    gesture: a change of the selection that is shown and not made yet. tint: of it, while a colour is chosen.
    hiding: how the selection is to be hidden for good, while that is asked; margin: of the last time.
    recipe_path: where a clean-up's recipe was written or read last. source: of the clone brush, world; fit:
    its copies are as fine as what is around them. clicked: what the last click on a thing found; outline: of
    the selection, where it was drawn last.
    """

    history: History | None = None
    saved: Marks | None = None
    tool: Tool = Tool.MOVE
    combine: Combine = "replace"
    radius: float = 24.0
    through: bool = False
    reach: float = 3.0
    drag: tuple[Point, ...] = ()
    waiting: str = ""
    searched: float = 1.0
    hover: Reading | None = None
    asked: Point | None = None
    card: Card | None = None
    names: tuple[tuple[str, ...], ...] = ()
    found: tuple[str, ...] = ()
    floaters: Floaters | None = None
    ruler: tuple[Spot, ...] = ()
    handle: Handle = Handle.MOVE
    gesture: Change | None = None
    tint: Tint | None = None
    hiding: Hiding | None = None
    margin: float = RECIPE_DEFAULTS.margin
    last_tint: Tint = Tint()
    recipe_path: Path | None = None
    source: Spot | None = None
    fit: bool = False
    clicked: Reached | None = None
    outline: Outline | None = None

    @property
    def reached(self) -> Reached | None:
        """What was clicked last, as long as nothing was edited since."""
        return self.clicked if self.clicked is not None and self.clicked.after is self.history else None

    @property
    def marks(self) -> Marks | None:
        return self.history.marks if self.history else None

    @property
    def num_selected(self) -> int:
        return len(self.history.marks.selected) if self.history else 0

    @property
    def num_deleted(self) -> int:
        return len(self.history.marks.deleted) if self.history else 0

    @property
    def draws(self) -> bool:
        """Whether the left button draws on the picture; without a source a clone brush is given one first."""
        return self.tool.selects or (self.tool is Tool.CLONE and self.source is not None)

    @property
    def placing(self) -> bool:
        """Whether the gizmo has something to move."""
        return self.tool is Tool.PLACE and self.num_selected > 0 and self.tint is None

    @property
    def dirty(self) -> bool:
        """Whether anything was marked since the last save, selections included."""
        return self.marks is not None and self.marks != self.saved

    @property
    def unsaved(self) -> bool:
        """Whether a saved file would differ from the one on disk."""
        if self.marks is None or self.saved is None:
            return self.marks is not None
        return self.marks.written != self.saved.written

    @property
    def exported_anew(self) -> bool:
        """Whether exports of the file on disk would miss edits; key frames they are told themselves."""
        if self.marks is None or self.saved is None:
            return self.unsaved
        return replace(self.marks, camera_path=()).written != replace(self.saved, camera_path=()).written

    def atom_name(self, k: int) -> str:
        """What the person calls an atom, or else its nearest word."""
        own = self.history.marks.atoms[k].name if self.history else ""
        words = self.names[k] if k < len(self.names) else ()
        return own or (words[0] if words else f"group {k}")


NO_EDITING = Editing()


def _stroke(inside: np.ndarray, start: np.ndarray, end: np.ndarray, radius: float) -> None:
    """Set the pixels within `radius` of the line from start to end, x and y."""
    height, width = inside.shape
    low = np.floor(np.minimum(start, end) - radius).astype(int).clip(0, (width, height))
    high = np.ceil(np.maximum(start, end) + radius).astype(int).clip(0, (width, height))
    x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
    along = end - start
    length = max(float(along @ along), 1e-12)
    share = (((x - start[0]) * along[0] + (y - start[1]) * along[1]) / length).clip(0, 1)
    apart = np.hypot(x - start[0] - share * along[0], y - start[1] - share * along[1])
    inside[low[1] : high[1], low[0] : high[0]] |= apart <= radius


def _inside_of(path: np.ndarray, width: int, height: int) -> np.ndarray:
    """(height, width) bool: pixels whose centre the closed path (n, 2) goes around, by the even-odd rule."""
    inside = np.zeros((height, width), bool)
    columns = np.arange(width) + 0.5
    for (x0, y0), (x1, y1) in zip(path, np.roll(path, -1, 0), strict=True):
        low, high = sorted((y0, y1))
        rows = np.arange(max(0, int(np.ceil(low - 0.5))), min(height, int(np.ceil(high - 0.5))))
        if len(rows):
            crossed = x0 + (rows + 0.5 - y0) / (y1 - y0) * (x1 - x0)
            inside[rows] ^= columns >= crossed[:, None]
    return inside


def strongest(weights: np.ndarray) -> tuple[tuple[int, float], ...]:
    """The atoms that a pixel carries most of, with their shares of all."""
    total = max(float(weights.sum()), 1e-9)
    order = np.argsort(-weights, kind="stable")[:TOP_ATOMS]
    return tuple((int(k), float(weights[k]) / total) for k in order if weights[k] > 0.005 * total)


def fresh(editing: Editing, history: History | None, saved: Marks | None, *, same: bool = False) -> Editing:
    """Editing of a scene that has just come; tool and settings stay in the hand. same: with more in it, it is
    the one on show, and so the source of the clone brush is there."""
    return Editing(
        history=history, saved=saved, tool=editing.tool, combine=editing.combine, radius=editing.radius,
        through=editing.through, reach=editing.reach, handle=editing.handle, last_tint=editing.last_tint,
        margin=editing.margin, recipe_path=editing.recipe_path, fit=editing.fit,
        source=editing.source if same else None,
    )  # fmt: skip
