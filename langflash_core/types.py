"""What crosses from one stage to the next: frozen dataclasses, and every convention.

Axes      OpenCV cameras: +x right, +y down, +z forward. World = camera of view 0.
Poses     `viewmats` (V, 4, 4) map world to camera: pos_c = R pos_w + t.
Pixels    `Ks` (V, 3, 3) in pixels; the centre of the top-left pixel is (0.5, 0.5).
          (u, v) = (fx x / z + cx, fy y / z + cy); of an orthographic camera (fx x + cx, fy y + cy).
Rotations quaternions wxyz, unit.
Values    bare names are activated: scales > 0 (standard deviations, scene units),
          opacities in [0, 1]. Stored forms say so: `log_scales`, `logit_opacities`.
Colour    the photo's sRGB values in [0, 1], no gamma change; colour = 0.5 + SH, clamped at 0;
          grey is `LUMA` times red, green, blue.
Lengths   scene units: the mean distance of view 0's points is 1. `metric_scale`, when
          known, is metres per scene unit.
Sizes     B batch, V views, N Gaussians, K atoms, C channels, S spherical-harmonic bases,
          m weights kept per Gaussian, P prompts, H W pixels.
Tensors   float32, on one device, unless a docstring says otherwise.
Checks    constructors refuse shapes that disagree and numbers that name nothing (an atom, a view).
          Values may be anything, as a network's are: `scene.checks` judges them where files are
          read and written.
"""

import math
import reprlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from importlib import import_module
from typing import Any

import torch
from jaxtyping import Bool, Float, Int, Integer, Shaped
from torch import Tensor

from langflash_core.base.records import Cost as Cost
from langflash_core.base.records import FoundFocal as FoundFocal
from langflash_core.base.records import FoundLens as FoundLens
from langflash_core.base.records import Record as Record
from langflash_core.base.records import check_light

LUMA = (0.299, 0.587, 0.114)
"""Weights of red, green and blue in grey (ITU-R BT.601, as JPEG has them)."""


class _Brief(reprlib.Repr):
    """Values as a notebook's cell prints them: of arrays and files their sizes, of long lists the start."""

    def repr_Tensor(self, x: Any, level: int) -> str:
        return f"{str(x.dtype).removeprefix('torch.')} {tuple(x.shape)}"

    def repr_bytes(self, x: bytes, level: int) -> str:
        return f"{len(x):,} bytes"

    def repr_Camera(self, x: "Camera", level: int) -> str:
        return f"Camera of {x.width} x {x.height}"


_BRIEF = _Brief()
_BRIEF.maxtuple, _BRIEF.maxother = 3, 300  # values; characters, which Gaussians of any number keep below


def _brief(self: Any) -> str:
    """The `repr` of a dataclass that holds arrays, in one line."""
    told = (f"{own.name}={_BRIEF.repr(getattr(self, own.name))}" for own in fields(self) if own.repr)
    return f"{type(self).__name__}({', '.join(told)})"


@dataclass(frozen=True)
class Camera:
    """One camera: `viewmat` (4, 4), `K` (3, 3) pixels, image size in pixels.

    A pinhole, unless it is `orthographic`: then its rays are parallel to its z axis, and its focal lengths
    are pixels per scene unit, at any depth. `light` (2, 3): gains and offsets of red, green and blue; the
    scene's colours y are shown as (y - offset) / gain; None: as they are.
    """

    viewmat: Float[Tensor, "4 4"]
    K: Float[Tensor, "3 3"]
    width: int
    height: int
    orthographic: bool = False
    light: Float[Tensor, "2 3"] | None = None

    def with_size(self, width: int, height: int) -> "Camera":
        """The same camera drawn at another size; the field of view is kept per axis."""
        ratio = torch.tensor([width / self.width, height / self.height, 1.0]).to(self.K)
        return replace(self, K=self.K * ratio[:, None], width=width, height=height)


@dataclass(frozen=True)
class Lenses:
    """What is known of the G lenses of V photos before the photos are compared.

    of: which lens took each photo. fovs: degrees of the longer side of the photos. doubts: standard
    deviations expected of the logarithm of the focal length; 0: it is given. recorded: the photos' files say
    it. note: what a person is told while a lens is assumed, or nothing. straightened: of each lens, as
    what the photos were straightened; nothing, or None: they are as they were taken. straight: nobody seeks
    more bends.
    """

    of: tuple[int, ...]
    fovs: tuple[float, ...]
    doubts: tuple[float, ...]
    recorded: tuple[bool, ...]
    note: str = ""
    straightened: tuple[FoundFocal | None, ...] = ()
    straight: bool = False

    def found(self, told: Sequence[FoundFocal | None]) -> tuple[FoundLens, ...]:
        """The lenses that photos told."""
        found = []
        for lens, own in enumerate(told):
            if own is None:
                continue
            before = math.tan(math.radians(self.fovs[lens] / 2))
            half = math.atan(before / own.growth)
            error = math.degrees(math.sin(2 * half) * own.error)  # d(2 atan(a / f)) / d(log f)
            fov = math.degrees(2 * half)
            bent = self.straightened[lens] if self.straightened else None
            bend = (0.0, 0.0) if bent is None else (bent.bend, bent.bend_error)
            found.append(FoundLens(fov, error, own.photos, self.fovs[lens], self.recorded[lens], *bend))
        return tuple(found)

    def settled(self, found: Sequence[FoundLens]) -> bool:
        """Nothing is assumed any more."""
        return sum(not lens.recorded for lens in found) >= sum(
            doubt > 0 and not recorded for doubt, recorded in zip(self.doubts, self.recorded, strict=True)
        )


@dataclass(frozen=True)
class Views:
    """Photos as the network sees them, all of one size.

    images: (V, 3, H, W) in [0, 1]. Ks: (V, 3, 3) pixels of these images, after crop and
    resize. names: file names for people. sources: the photos as small JPEG bytes, the same
    crop. warnings: triage, one sentence each. viewmats: (V, 4, 4), world = view 0, in any unit, where
    poses are given instead of sought. lenses: what `Ks` rest on; None: they are given.
    """

    images: Float[Tensor, "V 3 H W"]
    Ks: Float[Tensor, "V 3 3"]
    names: tuple[str, ...]
    sources: tuple[bytes, ...] = ()
    warnings: tuple[str, ...] = ()
    viewmats: Float[Tensor, "V 4 4"] | None = None
    lenses: Lenses | None = None

    __repr__ = _brief

    @property
    def num_views(self) -> int:
        return self.images.shape[0]

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        return self.images.shape[-1], self.images.shape[-2]


@dataclass(frozen=True)
class Gaussians:
    """N anisotropic Gaussians in world space.

    means (N, 3); quats (N, 4) wxyz unit; scales (N, 3) > 0; opacities (N,) in [0, 1];
    sh (N, S, 3) spherical-harmonic coefficients, S in {1, 4, 9, 16, 25}, 0 where they are not needed.

    Raises:
        ValueError: a field's shape is another.
    """

    means: Float[Tensor, "N 3"]
    quats: Float[Tensor, "N 4"]
    scales: Float[Tensor, "N 3"]
    opacities: Float[Tensor, " N"]
    sh: Float[Tensor, "N S 3"]

    def __post_init__(self) -> None:
        count, bases = len(self.means), self.sh.shape[1] if self.sh.ndim == 3 else 1
        for name, tail in (("means", (3,)), ("quats", (4,)), ("scales", (3,)), ("opacities", ())):
            _shape(name, getattr(self, name), (count, *tail))
        _shape("sh", self.sh, (count, bases, 3))

    __repr__ = _brief

    @staticmethod
    def none() -> "Gaussians":
        """Not a single one."""
        return Gaussians(*(torch.zeros(0, *tail) for tail in ((3,), (4,), (3,), (), (1, 3))))

    def __len__(self) -> int:
        return self.means.shape[0]

    def map(self, change: Callable[[Tensor], Tensor]) -> "Gaussians":
        """Apply `change` to every field (casting, moving)."""
        return Gaussians(*(change(v) for v in (self.means, self.quats, self.scales, self.opacities, self.sh)))

    def rows(self, keep: Shaped[Tensor, " n"]) -> "Gaussians":
        """Some of the Gaussians, as `Scene.rows`."""
        return self.map(lambda values: values[keep.to(values.device)])


NO_LANGUAGE = "none"  # the `space` of scenes that come from splat files


@dataclass(frozen=True)
class Semantics:
    """Sparse weights over a global dictionary: f_i = sum_j weight_values[i, j] d_{weight_ids[i, j]}.

    weight_ids (N, m) int64 in [0, K); weight_values (N, m) >= 0, rows sum to 1 (or 0 where a
    Gaussian carries nothing); dictionary (K, C), rows of unit norm; space: name of the
    language space the dictionary lives in ("minilm", "clip"; "none" where there is no language).

    Raises:
        ValueError: a field's shape or type is another, or an id names no atom.
    """

    weight_ids: Int[Tensor, "N m"]
    weight_values: Float[Tensor, "N m"]
    dictionary: Float[Tensor, "K C"]
    space: str

    def __post_init__(self) -> None:
        if self.weight_ids.ndim != 2 or self.dictionary.ndim != 2:
            found = f"{tuple(self.weight_ids.shape)}, {tuple(self.dictionary.shape)}"
            raise ValueError(f"weight_ids, dictionary: expected (N, m) and (K, C), received {found}")
        _shape("weight_values", self.weight_values, tuple(self.weight_ids.shape))
        _names("weight_ids", self.weight_ids, self.num_atoms)

    __repr__ = _brief

    @property
    def num_atoms(self) -> int:
        return self.dictionary.shape[0]

    def dense_weights(self) -> Float[Tensor, "N K"]:
        """w_ik as a dense (N, K) matrix; repeated ids add up."""
        dense = self.weight_values.new_zeros(self.weight_ids.shape[0], self.num_atoms)
        if self.num_atoms == 0:
            return dense
        return dense.scatter_add(1, self.weight_ids, self.weight_values)

    def rows(self, keep: Shaped[Tensor, " n"]) -> "Semantics":
        """What some of the Gaussians carry, as `Scene.rows`; the dictionary stays whole."""
        keep = keep.to(self.weight_ids.device)
        return replace(self, weight_ids=self.weight_ids[keep], weight_values=self.weight_values[keep])


@dataclass(frozen=True)
class Prediction:
    """What a network hands over, whatever its geometry: everything per pixel, view by view.

    gaussians: N = V*H*W of them, order (v h w), world = view 0, network length units; or none, where depths
    are to be covered by elements of other sizes.
    weights: (V, K, H, W) softmax over the K surviving groups (K may be 0).
    dictionary: (K, C) unit rows. viewmats (V, 4, 4). depths (V, H, W), z, same unit.
    confidences (V, H, W) in [0, 1]. unplaced: views whose pose is not known (view 0's stands in).
    timings: seconds per stage, in order. Ks: (V, 3, 3) as they were found, None: those of the views. lenses:
    what of them the photos told. bent: of each lens what was found, where one bends lines, so that photos are
    to be straightened first; nothing else was sought then (`of_bent`).
    """

    gaussians: Gaussians
    weights: Float[Tensor, "V K H W"]
    dictionary: Float[Tensor, "K C"]
    space: str
    viewmats: Float[Tensor, "V 4 4"]
    depths: Float[Tensor, "V H W"]
    confidences: Float[Tensor, "V H W"]
    unplaced: tuple[int, ...] = ()
    warnings: tuple[str, ...] = ()
    timings: dict[str, float] = field(default_factory=dict)
    Ks: Float[Tensor, "V 3 3"] | None = None
    lenses: tuple[FoundLens, ...] = ()
    bent: tuple[FoundFocal | None, ...] = ()

    __repr__ = _brief

    @staticmethod
    def of_bent(lenses: tuple[FoundFocal | None, ...], space: str, timings: dict[str, float]) -> "Prediction":
        """Of photos that are to be straightened: no photo, and no group."""
        maps, groups = torch.zeros(0, 0, 0), (torch.zeros(0, 0, 0, 0), torch.zeros(0, 0))
        nothing = *groups, space, torch.zeros(0, 4, 4), maps, maps
        return Prediction(Gaussians.none(), *nothing, timings=timings, bent=lenses)


@dataclass(frozen=True)
class Scene:
    """A finished scene: what is saved, splatted, queried, and exported.

    viewmats (V, 4, 4) and Ks (V, 3, 3) describe the input views at `view_size` (width, height).
    A scene from a splat file has no photos: its one view frames it, and its world is the file's.
    photos: small JPEG bytes per view, or none. view_ids: (N,) int64 in [0, V), the view that each
    Gaussian was predicted from; None where nobody knows; -1 of those that no photo of this scene made, which
    a merge brought and files do not tell apart.
    levels: (N,) uint8, 0 of the coarse Gaussians, which are a closed picture of the whole scene on their own,
    1 of the detail that lies on them; None: all are one level. confidences: (N,) float32 in [0, 1], how sure
    the depth was where each lies, a number beside the picture and no transparency; None: nobody knows.

    Raises:
        ValueError: sizes disagree, or a number names no view or no atom.
    """

    gaussians: Gaussians
    semantics: Semantics
    viewmats: Float[Tensor, "V 4 4"]
    Ks: Float[Tensor, "V 3 3"]
    view_size: tuple[int, int]
    photos: tuple[bytes, ...] = ()
    view_ids: Int[Tensor, " N"] | None = None
    record: Record = field(default_factory=Record)
    levels: Integer[Tensor, " N"] | None = None
    confidences: Float[Tensor, " N"] | None = None

    def __post_init__(self) -> None:
        count, num_views = len(self.gaussians), len(self.viewmats)
        if len(self.semantics.weight_ids) != count:
            found = len(self.semantics.weight_ids)
            raise ValueError(f"weight_ids: expected {count} rows, one per Gaussian, received {found}")
        _shape("viewmats", self.viewmats, (num_views, 4, 4))
        _shape("Ks", self.Ks, (num_views, 3, 3))
        if num_views < 1 or min(self.view_size) < 1:
            found = f"{num_views} of {self.view_size}"
            raise ValueError(f"views: expected at least one of at least 1 pixel, received {found}")
        if len(self.photos) not in (0, num_views):
            raise ValueError(f"photos: expected {num_views}, one per view, received {len(self.photos)}")
        if self.view_ids is not None:
            _shape("view_ids", self.view_ids, (count,))
            _names("view_ids", self.view_ids, num_views, lowest=-1)
        if self.levels is not None:
            _shape("levels", self.levels, (count,))
            _names("levels", self.levels, 2, dtype=torch.uint8)
        if self.confidences is not None:
            _shape("confidences", self.confidences, (count,))
            _shares("confidences", self.confidences)
        for name in ("atom_names", "atom_denials", "silent_atoms", "lone_atoms"):
            atoms = torch.tensor(list(getattr(self.record, name)), dtype=torch.int64)
            _names(name, atoms, self.semantics.num_atoms)
        check_light(self.record.light, num_views)

    def __repr__(self) -> str:
        """Three lines: how large, what it speaks, what is known of it."""
        (width, height), atoms, scale = self.view_size, self.semantics.num_atoms, self.record.metric_scale
        views = f"{self.num_views} view{'s' * (self.num_views > 1)} of {width} x {height} pixels"
        language = f"speaks {self.semantics.space!r} by {atoms} atoms" if atoms else "speaks no language"
        length = f"{scale:.3g} m per scene unit" if scale else "metres per scene unit not known"
        if not scale and self.record.world and (guess := self.record.world.guess):
            length = f"about {guess.metres:.2g} m per scene unit"
        return (
            f"Scene: {len(self.gaussians):,} Gaussians{', a layer per photo' * self.layered}; {views}\n"
            f"  {language}; {len(self.photos)} photos kept in it\n"
            f"  {length}; warnings when it was made: {len(self.record.warnings)} (scene.record.warnings)"
        )

    @property
    def num_views(self) -> int:
        return self.viewmats.shape[0]

    @property
    def layered(self) -> bool:
        """Whether every photo has a whole layer of its own, and a view is blended of the nearest ones
        (`splat.compose`)."""
        return self.record.layered and self.view_ids is not None

    def layer(self, view: int) -> "Scene":
        """What one photo made of a layered scene, and what no photo did, as a scene of one layer.

        Raises:
            ValueError: nobody knows which photo made which Gaussian.
        """
        if self.view_ids is None:
            raise ValueError("view_ids: expected the photo that made each Gaussian, received none")
        own = (self.view_ids == view) | (self.view_ids < 0)
        return self.rows(own).with_record(layered=False)

    def some_views(self, most: int) -> list[int]:
        """At most so many of the input views, evenly spaced, the first among them."""
        asked = min(self.num_views, most)
        return [place * self.num_views // asked for place in range(asked)]

    def camera(self, view: int, width: int | None = None, height: int | None = None) -> Camera:
        """Camera of input view `view` (from 0), optionally drawn at another size."""
        own = Camera(self.viewmats[view], self.Ks[view], *self.view_size)
        return own if width is None or height is None else own.with_size(width, height)

    def show(self, prompts: Sequence[str] | str = (), **options: Any) -> Any:
        """The scene in a cell of a notebook, as `showing.notebook.show` has it."""
        return import_module("langflash_core.showing.notebook").show(self, prompts, **options)

    def rows(self, keep: Shaped[Tensor, " n"]) -> "Scene":
        """The scene with some of its Gaussians; dictionary, views, photos and record stay.

        Args:
            keep: (N,) bool, or row numbers (n,) int64, in whose order they come.

        Raises:
            ValueError: a mask of another length, or neither of both.
        """
        if keep.ndim != 1 or keep.dtype not in (torch.bool, torch.int64):
            found = f"{keep.dtype} {tuple(keep.shape)}"
            raise ValueError(f"keep: expected (N,) bool or (n,) int64, received {found}")
        if keep.dtype == torch.bool:
            _shape("keep", keep, (len(self.gaussians),))
        else:
            _names("keep", keep, len(self.gaussians))
        return replace(
            self,
            gaussians=self.gaussians.rows(keep),
            semantics=self.semantics.rows(keep),
            view_ids=_select_rows(self.view_ids, keep),
            levels=_select_rows(self.levels, keep),
            confidences=_select_rows(self.confidences, keep),
        )

    def with_record(self, **changes) -> "Scene":
        """The scene with other values in fields of its record."""
        return replace(self, record=replace(self.record, **changes))


@dataclass(frozen=True)
class Frame:
    """One rendered view.

    rgb (H, W, 3), unclamped above, over `background`; alphas (H, W) = 1 - T;
    depths (H, W) = sum_i T_i a_i z_i / alpha, 0 where alpha < 1/255;
    weight_maps (H, W, K) = sum_i T_i a_i w_ik, or None when not asked for.
    """

    rgb: Float[Tensor, "H W 3"]
    alphas: Float[Tensor, "H W"]
    depths: Float[Tensor, "H W"]
    weight_maps: Float[Tensor, "H W K"] | None = None

    __repr__ = _brief

    def _repr_png_(self) -> bytes:
        """The colours, as a notebook shows them below a cell."""
        return import_module("langflash_core.export.png").rgb_file(self.rgb)


@dataclass(frozen=True)
class PromptAnswer:
    """One phrase answered in one view; the fields of `query --json`, and the mask.

    score: the value compared with `threshold` to decide `found`. area: fraction of pixels in
    the mask. centroid, box (center, axes (3, 3) rows, size): scene units, None when not found. note: for
    people, where the phrase may not mean what was written; "" for most. reading: how the phrase was
    understood, head first ("chair, white"); "" where it was asked as it stands. mask: (H, W) bool, its pixels
    in that view, none where it is not found; None where nobody keeps it. lit_from: the value from which a
    pixel belongs to it. maybe: not found, but nearly.
    """

    prompt: str
    found: bool
    score: float
    threshold: float
    area: float
    centroid: tuple[float, float, float] | None
    box: dict | None
    note: str = ""
    reading: str = ""
    mask: Bool[Tensor, "H W"] | None = field(default=None, repr=False, compare=False)
    lit_from: float = 0.0
    maybe: bool = False


@dataclass(frozen=True)
class QueryResult:
    """P prompts in one view.

    relevance (P, H, W): cosine in [-1, 1] or relevancy in (0, 1), as `mode` says; 0 where the
    view is empty. masks (P, H, W) bool. frame: the view they belong to.
    """

    answers: tuple[PromptAnswer, ...]
    mode: str
    relevance: Float[Tensor, "P H W"]
    masks: Bool[Tensor, "P H W"]
    frame: Frame
    camera: Camera

    def __repr__(self) -> str:
        """Three lines: of what, what is found, what is not."""
        told = {
            found: [
                f"{each.prompt} {each.score:.2f}{' (maybe)' * each.maybe}"
                for each in self.answers
                if each.found == found
            ]
            for found in (True, False)
        }
        return (
            f"QueryResult: {len(told[True])} of {len(self.answers)} phrases found in a view of "
            f"{self.camera.width} x {self.camera.height} pixels, by {self.mode}\n"
            f"  found: {_list_names(told[True])}\n"
            f"  not found: {_list_names(told[False])}"
        )


@dataclass(frozen=True)
class Segments:
    """What P phrases are made of, in 3D and so the same in every view.

    scores (P,): mean relevancy of the thousandth of what the photos show that answers best; found from
    `threshold` on. members (P, N) bool: Gaussians; of a phrase that is not found, none. instances
    (P, N) int64: which connected thing of the phrase each belongs to, from 1; 0 for others, for crumbs and
    for what no photo shows.

    Raises:
        ValueError: sizes disagree.
    """

    prompts: tuple[str, ...]
    scores: tuple[float, ...]
    threshold: float
    members: Bool[Tensor, "P N"]
    instances: Int[Tensor, "P N"]

    def __post_init__(self) -> None:
        for name in ("members", "instances"):
            _shape(name, getattr(self, name), (len(self.prompts), *self.members.shape[1:]))

    __repr__ = _brief

    @property
    def counts(self) -> tuple[int, ...]:
        """Connected things of each phrase."""
        return tuple(int(row.max()) if row.numel() else 0 for row in self.instances)

    @property
    def things(self) -> tuple[tuple[int, int], ...]:
        """Phrase (from 0) and number in it (from 1) of every connected thing, in order."""
        return tuple((phrase, n + 1) for phrase, count in enumerate(self.counts) for n in range(count))


@dataclass(frozen=True)
class SegmentedView:
    """One view of P phrases and their T connected things, edges as fine as they were drawn.

    mattes (P, H, W) in [0, 1]: sum_i T_i a_i over the Gaussians of a phrase, the share of the pixel's
    light that comes from it; union (H, W) likewise, of all phrases together. things (H, W) int64: 0, or
    1 + the place in `Segments.things` of what most of the pixel shows.
    """

    camera: Camera
    frame: Frame
    mattes: Float[Tensor, "P H W"]
    union: Float[Tensor, "H W"]
    things: Int[Tensor, "H W"]

    __repr__ = _brief

    @property
    def masks(self) -> Bool[Tensor, "P H W"]:
        """(P, H, W) bool: at least half of the pixel is the phrase."""
        return self.mattes >= 0.5

    @property
    def labels(self) -> Int[Tensor, "H W"]:
        """(H, W) int64: 1 + the phrase that most of the pixel is, where it is in a mask; else 0."""
        best, which = torch.where(self.masks, self.mattes, 0.0).max(0)
        return torch.where(best > 0, which + 1, 0)


def _list_names(names: Sequence[str], most: int = 6) -> str:
    """The first of some names in a row, and how many more there are; "-": none."""
    more = [f"{len(names) - most} more"] if len(names) > most else []
    return ", ".join([*names[:most], *more]) or "-"


def _shape(name: str, values: Tensor, expected: tuple[int, ...]) -> None:
    if tuple(values.shape) != expected:
        raise ValueError(f"{name}: expected shape {expected}, received {tuple(values.shape)}")


def _select_rows(values: Tensor | None, keep: Tensor) -> Tensor | None:
    """Some rows of what may not be known."""
    return None if values is None else values[keep.to(values.device)]


def _names(name: str, ids: Tensor, count: int, lowest: int = 0, dtype: torch.dtype = torch.int64) -> None:
    """Numbers of that type in [lowest, count)."""
    if ids.dtype != dtype:
        raise ValueError(f"{name}: expected {str(dtype).removeprefix('torch.')}, received {ids.dtype}")
    if ids.numel() == 0:
        return
    low, high = (int(bound) for bound in ids.aminmax())
    if low < lowest or high >= count:
        raise ValueError(f"{name}: expected values in [{lowest}, {count}), received {low} to {high}")


def _shares(name: str, values: Tensor) -> None:
    """Numbers float32 in [0, 1]."""
    if values.dtype != torch.float32:
        raise ValueError(f"{name}: expected float32, received {values.dtype}")
    if not bool(((values >= 0) & (values <= 1)).all()):  # nor is what is not finite
        raise ValueError(f"{name}: expected values in [0, 1], received others")
