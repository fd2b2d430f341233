"""The one worker thread: everything slow or heavy, and neither OpenGL nor ImGui.

A *job* makes a scene; the newest replaces and cancels the one before, which then falls silent.
*Errands* are short and run between jobs and, so that typing works during a reconstruction,
between the stages of one. Of `Encode` and `Answer` only the newest is ever run.
"""

import ctypes
import gc
import logging
import os
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from queue import Empty, SimpleQueue

import numpy as np
from PIL import Image

from app.window import ask_messages, chores, desk_chores, insight
from app.window.edit_messages import Weigh
from app.window.messages import (
    Answer,
    Compiled,
    CopyKept,
    Encode,
    Errand,
    Failed,
    FindPair,
    Job,
    KeepCopy,
    LoadScene,
    MakeThumbnails,
    Progress,
    ReconstructPhotos,
    Result,
    SceneReady,
    SceneWritten,
    Scored,
    Stopped,
    Thumbnail,
    WriteScene,
)
from app.window.state import SceneInfo
from langflash_core.errors import Cancelled, ImageError, LangFlashError
from langflash_core.scene.edits import History

log = logging.getLogger(__name__)

AHEAD = ("torch._dynamo", "torchvision", "timm", "langflash_core.pipeline")
"""What a reconstruction imports, some seconds of it, in the order in which one needs the next."""
IDLE = 0.5  # seconds without a request until the next of them is imported
THUMBNAIL_SIDE = 320  # pixels of the longer side
_SAVES = (WriteScene, ask_messages.WritePrompts)  # what a person asked for and `stop` waits for
SAVING_SECONDS = 60.0  # at the most
_ANSWERS_REPLACE = (Encode, Answer, Weigh)  # a newer one of these makes an older one pointless


class Worker:
    """A thread with a mailbox. `notify` is called, from the thread, after each result.

    `submit` and `cancel` return at once. `stop` cancels, waits at most `patience` seconds, and
    may be called twice. Unless `begins`, what is asked of it waits for `begin`.
    """

    def __init__(self, notify: Callable[[], None] = lambda: None, begins: bool = True) -> None:
        self._notify = notify
        self._changed = threading.Condition()
        self._errands: list[Errand] = []
        self._errand: Errand | None = None  # under way
        self._job: Job | None = None
        self._token = 0  # of the newest job; an older one is silent
        self._busy = False  # with a job that speaks
        self._stopping = False
        self._results: SimpleQueue[Result] = SimpleQueue()
        self._serial = 0
        self._thread = threading.Thread(target=self._run, name="langflash-worker", daemon=True)
        if begins:
            self.begin()

    def begin(self) -> None:
        """Start the thread, once; it takes seconds to load what it needs."""
        if self._thread.ident is None:
            self._thread.start()

    def submit(self, request: Job | Errand) -> None:
        """Queue a request; a job cancels the job under way."""
        with self._changed:
            if isinstance(request, ReconstructPhotos | LoadScene):
                self._job = request
                self._token += 1
            else:
                kept = self._errands
                if isinstance(request, _ANSWERS_REPLACE):
                    kept = [e for e in kept if type(e) is not type(request)]
                self._errands = [*kept, request]
            self._changed.notify()

    def cancel(self) -> None:
        """Stop the job; `Stopped` comes at once, and the job ends within a layer of the network."""
        with self._changed:
            busy = self._busy or self._job is not None
            self._token += 1  # from here on the job is silent
            self._job, self._busy = None, False
        if busy:
            self._put(Stopped())

    def poll(self) -> list[Result]:
        """Results that have arrived since the last call, oldest first."""
        results: list[Result] = []
        while True:
            try:
                results.append(self._results.get_nowait())
            except Empty:
                return results

    def stop(self, patience: float = 2.0) -> None:
        """End the thread, after what it was told to save. A stage that takes longer than `patience`
        dies with the process."""
        with self._changed:
            self._stopping = True
            self._errands = [errand for errand in self._errands if isinstance(errand, _SAVES)]
            if self._errands or isinstance(self._errand, _SAVES):
                patience = SAVING_SECONDS
                self.begin()
            self._changed.notify()
        if self._thread.ident is not None:
            self._thread.join(patience)

    def _put(self, result: Result) -> None:
        self._results.put(result)
        self._notify()

    def _run(self) -> None:
        try:
            _import_heavy()
        except Exception as error:  # a broken installation: say so, and let each request say it again
            self._put(Failed(_unexpected(error), job=False))
        foresight = list(AHEAD)
        while True:
            with self._changed:
                self._changed.wait_for(self._asked, IDLE if foresight else None)
                if self._stopping and not self._errands:
                    return
                job, token = self._job, self._token
                if not self._errands:
                    self._job, self._busy = None, job is not None
            if self._errands:
                self._run_errands()
            elif job is not None:
                self._run_job(job, token)
            elif foresight:
                _import_ahead(foresight.pop(0))

    def _asked(self) -> bool:
        return bool(self._stopping or self._errands or self._job)

    def _run_errands(self) -> None:
        """Run what is queued now, oldest first."""
        while True:
            with self._changed:
                if not self._errands:
                    self._errand = None
                    return
                errand, *self._errands = self._errands
                self._errand = errand
            try:
                self._put_all(errand)
            except LangFlashError as error:
                self._put(Failed(str(error), job=False))
            except Exception as error:
                self._put(Failed(_unexpected(error), job=False))

    def _put_all(self, errand: Errand) -> None:
        match errand:
            case Encode():
                self._put(compile_prompts(errand))
            case Answer():
                self._put(score_prompts(errand))
                self._put(insight.bin_scores(errand))
            case WriteScene(scene, path, marks):
                from langflash_core.export import export
                from langflash_core.scene.edited import edited_scene

                export(scene if marks is None else edited_scene(scene, marks), path)
                self._put(SceneWritten(path, marks))
            case MakeThumbnails(paths):
                for path in paths:
                    self._put(make_thumbnail(path))
            case ask_messages.WritePrompts() | ask_messages.ReadPrompts() | ask_messages.DescribeAtoms():
                self._put(insight.run(errand))
            case KeepCopy(serial, scene, path, marks):
                desk_chores.keep_copy(scene, path, marks)
                self._put(CopyKept(serial, path))
            case FindPair(paths):
                self._put(desk_chores.find_pair(paths, lambda: self._stopping))
            case _:
                answer = chores.run(errand)
                if answer is not None:
                    self._put(answer)

    def _run_job(self, job: Job, token: int) -> None:
        def stale() -> bool:
            return self._token != token

        def cancelled() -> bool:
            return self._stopping or stale()

        def progress(stage: str, fraction: float) -> None:
            if not stale():
                self._put(Progress(stage, fraction))
            self._run_errands()

        self._serial += 1
        try:
            ready = make_scene(job, self._serial, progress, cancelled)
            outcome: Result | None = ready
        except Cancelled:
            outcome = None  # whoever stopped it has been told
        except LangFlashError as error:
            outcome = Failed(str(error), job=True)
        except Exception as error:
            outcome = Failed(_unexpected(error), job=True)
        with self._changed:
            spoken = outcome is not None and not stale()
            self._busy = self._busy and stale()
        if spoken and outcome is not None:
            self._put(outcome)
        else:
            _give_back_memory()


def make_scene(
    job: Job, serial: int, progress: Callable[[str, float], None], cancelled: Callable[[], bool]
) -> SceneReady:
    """Reconstruct or load, and look the scene over for the window.

    Raises:
        LangFlashError: what `reconstruct` and `load` raise; Cancelled among them.
    """
    if isinstance(job, LoadScene):
        from langflash_core.export import read

        scene = read(job.path)
        if job.edits is not None:
            return SceneReady(_restored(describe_scene(scene, serial, ""), job.edits))
        return SceneReady(describe_scene(scene, serial, job.path.name, job.path))
    from langflash_core.pipeline import reconstruct

    scene = reconstruct(job.paths, fov=job.fovs or None, progress=progress, cancelled=cancelled)
    name = " + ".join(path.stem for path in job.paths[:3]) + (" ..." if len(job.paths) > 3 else "")
    return SceneReady(describe_scene(scene, serial, name))


def _restored(info: SceneInfo, edits: Path) -> SceneInfo:
    """The scene with the edits of an earlier session, its name and its place.

    Raises:
        SceneFileError: the edits cannot be read.
    """
    from langflash_core.scene.edits_file import load_history, read_about

    assert info.history is not None
    history = load_history(edits, info.scene, info.history.marks)
    about = read_about(edits)[1]
    path = Path(about["path"]) if about.get("path") else None
    return replace(info, name=str(about.get("name", "")), path=path, history=history)


def describe_scene(scene, serial: int, name: str, path: Path | None = None) -> SceneInfo:
    """`SceneInfo` of a `Scene`: counts, warnings, and a pose per input view."""
    from app.window.poses import from_view, median_reach
    from langflash_core.scene.edited import first_marks
    from langflash_core.types import NO_LANGUAGE

    mute = scene.semantics.space == NO_LANGUAGE
    said = ("This splat file holds no language: phrases find nothing in it.",) if mute else ()
    means = scene.gaussians.means.double().numpy()
    views = []
    for viewmat, K in zip(scene.viewmats.double().numpy(), scene.Ks.double().numpy(), strict=True):
        views.append(from_view(viewmat, K, scene.view_size, median_reach(means, viewmat, K, scene.view_size)))
    return SceneInfo(
        serial=serial,
        name=name,
        scene=scene,
        views=tuple(views),
        num_gaussians=len(scene.gaussians),
        num_atoms=scene.semantics.num_atoms,
        space=scene.semantics.space,
        warnings=(*said, *scene.record.warnings),
        path=path,
        history=History(first_marks(scene)),
        own_views=scene.num_views > 1 and scene.view_ids is not None,
        extent=_extent(means),
    )


def _extent(means: np.ndarray):
    """Corners of the box around the middle 98 % of the means (N, 3) along each axis."""
    from app.window.poses import Vector

    if not len(means):
        return None
    low, high = np.percentile(means, (1, 99), axis=0)
    return Vector(*low.tolist()), Vector(*high.tolist())


def compile_prompts(request: Encode) -> Compiled:
    """Text towers and the reduced dictionary; milliseconds once the tower is loaded."""
    from langflash_core.language.relevance import compile_query
    from langflash_core.language.spaces import language_space
    from langflash_core.language.words import with_vectors
    from langflash_core.scene.edited import spoken_scene

    scene = request.scene if request.marks is None else spoken_scene(request.scene, request.marks)
    space = language_space(scene.semantics.space)
    query = compile_query(scene, space, list(request.texts), negatives=list(request.negatives) or None)
    likes = {row: _vector(like) for row, like in enumerate(request.likes) if like}
    query = with_vectors(query, scene.semantics.dictionary, likes)
    return Compiled(request.serial, request.keys, query)


def _vector(content: bytes):
    import torch

    return torch.from_numpy(np.frombuffer(content, np.float32).copy())


def score_prompts(request: Answer) -> Scored:
    """Scores of the prompts in the view on show."""
    from langflash_core.language.answers import answer

    result = answer(request.relevance, request.frame, request.camera, request.query)
    scores = tuple(
        (key, a.prompt, float(a.score)) for key, a in zip(request.keys, result.answers, strict=True)
    )
    return Scored(request.serial, scores)


def make_thumbnail(path: Path) -> Thumbnail:
    """A small upright picture of a photo and what its file says; an unreadable one gives its problem."""
    from langflash_core.images.decode import read_photo

    try:
        photo = read_photo(path)
    except ImageError as error:
        return Thumbnail(str(path), None, str(error))
    small = photo.image.copy()
    small.thumbnail((THUMBNAIL_SIDE, THUMBNAIL_SIDE))
    fov, notes = desk_chores.look_at(photo)
    return Thumbnail(str(path), np.asarray(small.convert("RGB")), fov=fov, notes=notes)


def _import_heavy() -> None:
    """Load torch and the renderer's module here, while the window is already up."""
    _link_torch()
    import torch  # noqa: F401

    import app.gl

    Image.preinit()  # else the first thumbnail of the window does
    gc.freeze()
    log.debug("loaded %s", app.gl.__name__)


def _link_torch() -> None:
    """Link torch's largest library through a foreign call, which lets go of the interpreter.

    `import torch` would hold on to it for about half a second, and so hold up a frame.
    """
    spec = find_spec("torch")
    if sys.platform != "linux" or spec is None or spec.origin is None:
        return
    library = Path(spec.origin).parent / "lib" / "libtorch_cpu.so"
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).dlopen(os.fsencode(library), os.RTLD_NOW)  # 0 where it fails: torch will say why


def _import_ahead(name: str) -> None:
    """Import what the first reconstruction would wait for, while nobody waits."""
    from langflash_core.torchvision_fix import ensure_torchvision

    try:
        if name == "torchvision":
            ensure_torchvision()
        else:
            import_module(name)
    except Exception:  # who needs it will say so
        log.debug("%s cannot be imported", name, exc_info=True)
    # What modules hold stays for good. The collector, which stops every thread, need not look at it
    # again: that took a fifth of a second each time.
    gc.freeze()


def _give_back_memory() -> None:
    """What a stopped job held goes back to the system, where the allocator would keep it.

    Its tensors are gone by now, without the collector, which would stop the window for a while.
    """
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).malloc_trim(0)


def _unexpected(error: Exception) -> str:
    log.exception("the worker met an unexpected error")
    return f"Something unexpected went wrong ({type(error).__name__}: {error}); please report it."
