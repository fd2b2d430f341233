"""The worker's side of the scene: making, reading and writing it, and looking at photos.

Heavy imports wait until they are needed: the window makes these requests before torch is loaded.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from langflash_core.base.detail import DEFAULT_DETAIL
from langflash_core.base.picture_files import STORED, opened_picture
from langflash_core.errors import ImageError, SceneFileError
from langflash_core.geometry.poses import Vector, from_view
from langflash_core.geometry.reach import median_reach
from langflash_core.images.still_names import film_of, shown_name
from langflash_core.reconstruction.networks import Networks
from langflash_core.scene.doubts import doubtful, told_warnings
from langflash_core.scene.edits import History, Marks

from ..commands import Command, ShowPicture
from ..governor import LEAST_OF_HUGE, Around
from ..requests import Asked, Job, SceneTask, Task
from . import unfinished
from .commands import (
    ChoosingFailed,
    PairChosen,
    PhotoFailed,
    PhotoRead,
    SceneArrived,
    SceneSaved,
    Thinned,
    WorkFound,
)
from .lenses import told_lenses
from .memory import SceneMemory
from .merging import Merged
from .standing import Levelled
from .state import ABOVE, WHOLE_PHOTOS, SceneInfo

if TYPE_CHECKING:
    from langflash_core.images.decode import Photo
    from langflash_core.scene.above import Above
    from langflash_core.types import Scene

THUMBNAIL_SIDE = 320  # pixels of the longer side


# Jobs


@dataclass(frozen=True)
class ReconstructPhotos(Job):
    """Make a scene of photos; of many it goes on from what was kept (`unfinished`). fovs: degrees of the
    longer side, one per photo; None: its record. detail: its name (`base.detail`). films: what became
    of the frames of those that photos are of, as `Record.left_out` has it. networks: the session's,
    so that weights are read once."""

    paths: tuple[Path, ...]
    fovs: tuple[float | None, ...] = ()
    detail: str = DEFAULT_DETAIL
    films: tuple[dict, ...] = ()
    networks: Networks = field(default_factory=Networks, repr=False, compare=False)

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> SceneArrived:
        from langflash_core.pipeline import reconstruct

        lenses = self.fovs or None
        with unfinished.kept(self.paths) as keep:
            scene = reconstruct(
                self.paths,
                fov=lenses,
                detail=self.detail,
                keep=keep,
                progress=progress,
                cancelled=cancelled,
                networks=self.networks,
            )
        if self.films:
            scene = scene.with_record(left_out={**scene.record.left_out, "films": list(self.films)})
        return SceneArrived(describe_scene(scene, serial, called(self.paths)))


def called(photos: Sequence[Path]) -> str:
    """What a scene of these photos is called: as they are, or as the film that all are of."""
    films = {film_of(path.name) for path in photos}
    if len(films) == 1 and (film := films.pop()) is not None:
        return Path(film).stem
    return " + ".join(path.stem for path in photos[:3]) + (" ..." if len(photos) > 3 else "")


@dataclass(frozen=True)
class LoadScene(Job):
    """Read a scene file; or, with `edits`, the scene and the history that an earlier session kept.

    alone: as in `OpenScene`.
    """

    path: Path
    edits: Path | None = None
    alone: bool = False

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> SceneArrived:
        from langflash_core.export import read as read_scene

        if self.edits is not None and not (self.edits.is_file() and self.path.is_file()):
            raise SceneFileError("the saved progress is gone; another window is using it")
        scene = read_scene(self.path)
        info = describe_scene(scene, serial, self.path.name, self.path)
        return SceneArrived(info if self.edits is None else _restored(info, self.edits), self.alone)


@dataclass(frozen=True)
class OnShow(Job):
    """Makes another scene of the one on show, as `marks` edited it."""

    info: SceneInfo
    marks: Marks = field(repr=False)


@dataclass(frozen=True)
class JoinScenes(OnShow):
    """Read a scene file and put what it holds beside the scene on show, as far as that is there."""

    path: Path

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> Merged:
        from langflash_core.export import read as read_scene
        from langflash_core.scene.edited import edited_scene, there
        from langflash_core.scene.joining import join_scenes
        from langflash_core.surface.fused import fuse_layers

        own, name = self.info, self.path.name
        first, shown = there(own.scene, self.marks), edited_scene(own.scene, self.marks)
        scene = join_scenes(first, fuse_layers(read_scene(self.path)), (own.name, name), shown)
        info = describe_scene(scene, serial, own.name, own.path)
        return Merged(own.serial, self.marks.there, info, name)


@dataclass(frozen=True)
class PutInPhotos(OnShow):
    """The scene on show, as it is edited, with a layer of each of these photos."""

    photos: tuple[Path, ...]
    networks: Networks = field(default_factory=Networks, repr=False, compare=False)

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> SceneArrived:
        from langflash_core.pipeline import add_photos
        from langflash_core.scene.edited import edited_scene

        shown = edited_scene(self.info.scene, self.marks)
        grown = add_photos(shown, self.photos, progress=progress, cancelled=cancelled, networks=self.networks)
        return SceneArrived(describe_scene(grown, serial, self.info.name))


def _restored(info: SceneInfo, edits: Path) -> SceneInfo:
    """The scene with the edits of an earlier session, its name and its place.

    Raises:
        SceneFileError: the edits cannot be read.
    """
    from langflash_core.scene.edits_file import load_history, read_about

    history = load_history(edits, info.scene)
    about = read_about(edits)[1]
    path = Path(about["path"]) if about.get("path") else None
    return replace(info, name=str(about.get("name", "")), path=path, history=history)


def describe_scene(scene: "Scene", serial: int, name: str, path: Path | None = None) -> SceneInfo:
    """`SceneInfo` of a `Scene`: counts, warnings, and a pose per input view."""
    from langflash_core.scene.above import seen_from_above
    from langflash_core.scene.edited import first_marks
    from langflash_core.types import NO_LANGUAGE

    mute = scene.semantics.space == NO_LANGUAGE
    said = ("This file cannot answer phrases yet; teach it some, beside the phrases.",) if mute else ()
    means = scene.gaussians.means.double().numpy()
    views = []
    for viewmat, K in zip(scene.viewmats.double().numpy(), scene.Ks.double().numpy(), strict=True):
        views.append(from_view(viewmat, K, scene.view_size, median_reach(means, viewmat, K, scene.view_size)))
    memory = SceneMemory(scene)
    memory.surroundings()  # a hand on the picture does not wait for it
    return SceneInfo(
        serial=serial,
        name=name,
        scene=scene,
        memory=memory,
        views=tuple(views),
        num_gaussians=len(scene.gaussians),
        num_atoms=scene.semantics.num_atoms,
        space=scene.semantics.space,
        warnings=(*said, *told_warnings(scene.record, scene.num_views)),
        doubts=doubtful(scene.record, scene.num_views),
        path=path,
        history=History(first_marks(scene)),
        own_views=scene.num_views > 1 and scene.view_ids is not None,
        extent=_extent(means),
        above=seen_from_above(scene),
        lenses=told_lenses(scene.record),
    )


def _extent(means: np.ndarray) -> tuple[Vector, Vector] | None:
    """Corners of the box around the middle 98 % of the means (N, 3) along each axis."""
    if not len(means):
        return None
    low, high = np.percentile(means, (1, 99), axis=0)
    return Vector(*low.tolist()), Vector(*high.tolist())


# Tasks


@dataclass(frozen=True)
class WriteScene(Task):
    """Write a scene file of the scene as edited."""

    saves = True

    scene: "Scene" = field(repr=False)
    path: Path
    marks: Marks | None = None

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.export import export
        from langflash_core.scene.edited import edited_scene

        scene = self.scene if self.marks is None else edited_scene(self.scene, self.marks)
        export(scene, self.path)
        yield SceneSaved(self.path, self.marks)


@dataclass(frozen=True)
class FindWorld(SceneTask):
    """How the scene stands, as edited."""

    newest_counts = True

    memory: SceneMemory = field(repr=False)
    marks: Marks

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.level import found_world
        from langflash_core.scene.edited import without_deleted

        yield Levelled(found_world(without_deleted(self.memory.changed(self.marks), self.marks)))


@dataclass(frozen=True)
class Thin(SceneTask):
    """Fewer, wider Gaussians for a moving camera."""

    scene: "Scene" = field(repr=False)
    share: float

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.scene.thin import thin_with_rows

        from ...gl.scene import Thinned as Fewer

        yield Thinned(self.scene, self.share, Fewer(*thin_with_rows(self.scene, self.share)))


@dataclass(frozen=True)
class ThinAround(SceneTask):
    """The same of a huge scene: fine around the eye, coarser the farther away; then fewer of these."""

    newest_counts = True
    urgent = True

    memory: SceneMemory = field(repr=False)
    share: float
    eye: Vector

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.scene.thin import Thinner

        from ...gl.scene import Thinned as Fewer
        from ...gl.splats import Drawable

        scene = self.memory.scene
        thinner = self.memory.answered("thinner", (), lambda: Thinner(scene))
        thinned, rows, reach = thinner.around(np.array(self.eye), self.share)
        fewer = Fewer(thinned, rows, Drawable.of(thinned))
        yield Thinned(scene, self.share, fewer, Around(self.eye, reach))
        least, some, _ = Thinner(thinned).around(np.array(self.eye), LEAST_OF_HUGE)
        yield Thinned(scene, self.share * LEAST_OF_HUGE, Fewer(least, rows[some], Drawable.of(least)))


@dataclass(frozen=True)
class ShowPhotos(SceneTask):
    """A scene's photos as pictures, one after another: few of them whole, many small, since all of them whole
    would fill the graphics card."""

    photos: tuple[bytes, ...] = field(repr=False)

    def run(self, stopping: Asked) -> Iterator[Command]:
        for index, encoded in enumerate(self.photos):
            # A scene whose small photos are damaged still shows; buttons get numbers.
            with suppress(OSError, SyntaxError, ValueError), opened_picture(encoded, STORED) as photo:
                if len(self.photos) > WHOLE_PHOTOS:
                    photo.draft("RGB", (THUMBNAIL_SIDE, THUMBNAIL_SIDE))
                    photo.thumbnail((THUMBNAIL_SIDE, THUMBNAIL_SIDE))
                yield ShowPicture(f"view {index}", np.asarray(photo.convert("RGB")))


@dataclass(frozen=True)
class DrawAbove(SceneTask):
    """The picture of the map."""

    scene: "Scene" = field(repr=False)
    above: "Above" = field(repr=False)

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.scene.above import drawn_from_above

        yield ShowPicture(ABOVE, drawn_from_above(self.scene, self.above))


@dataclass(frozen=True)
class MakeThumbnails(Task):
    """Decode photos small, and say what their files do."""

    paths: tuple[Path, ...]

    def run(self, stopping: Asked) -> Iterator[Command]:
        for path in self.paths:
            yield from _thumbnail(path)


@dataclass(frozen=True)
class LookForWork(Task):
    """Whether work on these photos was begun and kept."""

    paths: tuple[Path, ...]

    newest_counts = True
    light = True

    def run(self, stopping: Asked) -> Iterator[Command]:
        yield WorkFound(self.paths, unfinished.is_unfinished(self.paths))


@dataclass(frozen=True)
class DropWork(Task):
    """Forget the work on these photos."""

    paths: tuple[Path, ...]

    def run(self, stopping: Asked) -> Iterator[Command]:
        unfinished.drop(self.paths)
        yield WorkFound(self.paths, False)


def _thumbnail(path: Path) -> Iterator[Command]:
    """A small upright picture of a photo and what its file says; of an unreadable one its problem."""
    from langflash_core.images.decode import read_photo

    try:
        photo = read_photo(path, shown_name(path.name))
    except ImageError as error:
        yield PhotoFailed(path, str(error))
        return
    small = photo.image.copy()
    small.thumbnail((THUMBNAIL_SIDE, THUMBNAIL_SIDE))
    yield ShowPicture(str(path), np.asarray(small.convert("RGB")))
    yield PhotoRead(path, *_look_at(photo))


def _look_at(photo: "Photo") -> tuple[float | None, tuple[str, ...]]:
    """The recorded field of view of the longer side in degrees, if any, and the triage notes."""
    import torch

    from langflash_core.images.lens import exif_focal
    from langflash_core.images.pictures import judged_grey
    from langflash_core.images.triage import photo_notes

    focal = exif_focal(photo)
    side = max(photo.width, photo.height)
    fov = None if focal is None else 2 * math.degrees(math.atan(side / (2 * focal)))
    small = photo.image.copy()
    small.thumbnail((256, 256))  # about what the network sees
    image = torch.from_numpy(np.array(small, dtype=np.float32)).permute(2, 0, 1) / 255
    return fov, tuple(photo_notes(photo, image, judged_grey(photo.image)))


@dataclass(frozen=True)
class FindPair(Task):
    """The two photos that make the best scene."""

    paths: tuple[Path, ...]

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.pipeline import best_pair

        yield PairChosen(self.paths, best_pair(self.paths, cancelled=stopping))

    def failed(self, sentence: str) -> Iterable[Command]:
        return (ChoosingFailed(sentence),)
