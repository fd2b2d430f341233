"""What a worker of `langflash batch` does with one set: what `reconstruct`, `query` and `export` would."""

import contextlib
import io
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import torch
from PIL import Image

from langflash_core import pipeline
from langflash_core.base.files import filled_atomically, readable_file, write_atomically
from langflash_core.base.memory import peak_memory_mb
from langflash_core.base.optional import optional_packages
from langflash_core.base.picture_files import STORED, opened_picture
from langflash_core.batch.dispatch import Job, Made
from langflash_core.batch.order import Order, export_path
from langflash_core.batch.run import SCENE
from langflash_core.batch.summary import THUMBNAIL
from langflash_core.errors import ImageError, PromptError
from langflash_core.export.answers import answers_document, write_answers
from langflash_core.export.png import heat_over, to_8bit
from langflash_core.reconstruction.networks import Networks
from langflash_core.scene.file import load, save
from langflash_core.types import QueryResult, Scene
from langflash_core.writing import CameraChoice, Renderer, request_of_whole, write

from .renderers import open_renderer
from .report import explained, write_json

ANSWERS = "answers"  # folder, in a set's own
_HEIGHT = 96  # pixels of a thumbnail
_HEATS = 3  # at most, on a thumbnail


@contextlib.contextmanager
def open_maker(order: Order, threads: int) -> Iterator[Callable[[Job], Made]]:
    """What makes one set after the other in this process; network and renderer are loaded once.

    Args:
        threads: of torch, of OpenCV and of Mesa's software OpenGL, each.
    """
    torch.set_num_threads(threads)
    cv2.setNumThreads(threads)
    os.environ.setdefault("LP_NUM_THREADS", str(threads))
    with contextlib.ExitStack() as stack:
        maker = _Maker(order, stack)
        yield maker.make


class _Maker:
    def __init__(self, order: Order, stack: contextlib.ExitStack) -> None:
        self._order = order
        self._stack = stack
        self._opened: Renderer | None = None
        self._networks = Networks()

    def make(self, job: Job) -> Made:
        """Fill the job's folder, or say why not; no error leaves this, and nothing is printed."""
        start = time.perf_counter()
        try:
            with contextlib.redirect_stderr(io.StringIO()), optional_packages():
                scene, result, notes = self._filled(job)
        except Exception as error:
            return Made(explained(error), time.perf_counter() - start)
        return Made(
            seconds=time.perf_counter() - start,
            gaussians=len(scene.gaussians),
            groups=scene.semantics.num_atoms,
            found="" if result is None else f"{sum(a.found for a in result.answers)}/{len(result.answers)}",
            memory_mb=peak_memory_mb() or 0,
            warnings=(*scene.record.warnings, *notes),
        )

    def _filled(self, job: Job) -> tuple[Scene, QueryResult | None, list[str]]:
        """The scene, the answers where phrases are asked, and what could not be exported."""
        order = self._order
        if not job.photos:
            raise ImageError("there are no photos in it; put some there, or take it away")
        for photo in job.photos:
            readable_file(photo, "photo", ImageError)
        scene = pipeline.reconstruct(
            job.photos,
            preset=order.preset,
            weights=order.weights,
            size=order.size,
            detail=order.detail,
            gaussians=order.gaussians,
            fov=order.fov,
            device=order.device,
            networks=self._networks,
        )
        with filled_atomically(job.folder) as staging:
            save(scene, staging / SCENE)
            scene = load(staging / SCENE)  # answers are those of the file, to the last digit
            result = self._asked(scene, staging / ANSWERS) if order.prompts else None
            notes = self._exported(scene, staging)
            write_thumbnail(scene, result, staging / THUMBNAIL)
        return scene, result, notes

    def _asked(self, scene: Scene, folder: Path) -> QueryResult:
        """Answer the phrases in the first photo's view; pictures as `query` writes them, and its document."""
        renderer = self._renderer()
        camera = CameraChoice(view=0, described=None, size=None, full=True).of(scene)
        result = pipeline.query(scene, self._order.prompts, camera=camera, render=renderer)
        files = [
            {kind: Path(path).name for kind, path in entry.items()} for entry in write_answers(result, folder)
        ]
        document = {"scene": f"../{SCENE}", "view": 1, "backend": renderer.backend}
        stream = io.StringIO()
        write_json({**document, **answers_document(scene, result, files)}, stream)
        write_atomically(folder / "answers.json", stream.getvalue().encode())
        return result

    def _exported(self, scene: Scene, folder: Path) -> list[str]:
        """Write the files that are wanted besides; where no phrase is found, a note instead of its masks."""
        notes = []
        for kind in self._order.exports:
            path = folder / export_path(kind)
            try:
                request = request_of_whole(path, self._order.prompts)
                write(scene, request, renderers=lambda: contextlib.nullcontext(self._renderer()))
            except PromptError as reason:
                notes.append(f"no {path.name}: {reason}")
        return notes

    def _renderer(self) -> Renderer:
        if self._opened is None:
            self._opened = self._stack.enter_context(open_renderer(self._order.backend))
        return self._opened


def write_thumbnail(scene: Scene, result: QueryResult | None, path: Path) -> None:
    """The first photo, and beside it the heat of the first phrases, as a small JPEG.

    Raises:
        OutputError: it cannot be written.
    """
    pictures = []
    if scene.photos:
        with opened_picture(scene.photos[0], STORED) as photo:
            pictures.append(photo.convert("RGB"))
    for answer, relevance in zip(result.answers[:_HEATS], result.relevance, strict=False) if result else ():
        assert result is not None
        lit = heat_over(relevance, result.frame.rgb, answer.lit_from, result.mode)
        pictures.append(Image.fromarray(to_8bit(lit)))
    small = [p.resize((max(1, round(_HEIGHT * p.width / p.height)), _HEIGHT)) for p in pictures]
    stream = io.BytesIO()
    Image.fromarray(np.concatenate([np.asarray(p) for p in small], axis=1)).save(stream, "JPEG", quality=80)
    write_atomically(path, stream.getvalue())
