"""What a writer is given: the scene, what is asked for, and who draws."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from langflash_core import pipeline
from langflash_core.base.colormaps import HeatColours
from langflash_core.base.files import check_beside, check_output_file
from langflash_core.base.outputs import Output
from langflash_core.base.request import ExportRequest
from langflash_core.base.running import Progress
from langflash_core.errors import PromptError
from langflash_core.types import Camera, PromptAnswer, QueryResult, Scene
from langflash_core.writing.cameras import CameraChoice
from langflash_core.writing.renderers import Renderer, Shown

Answers = tuple[PromptAnswer, ...]  # of one view


def kept_of(result: QueryResult) -> Answers:
    """The answers without their masks, to keep while other views are asked."""
    return tuple(replace(each, mask=None) for each in result.answers)


def plural(number: int, what: str) -> str:
    """`1 view`, `2 views`."""
    return f"{number} {what}{'s' * (number != 1)}"


def no_progress(stage: str, fraction: float) -> None:
    """Tells nobody."""


@dataclass(frozen=True)
class Job:
    """One file, or one group of files, to write. renderers: opens who draws."""

    request: ExportRequest
    kind: Output
    scene: Scene
    choice: CameraChoice
    renderers: Callable[[], AbstractContextManager[Renderer]]
    progress: Progress

    @property
    def prompts(self) -> list[str]:
        """The phrases."""
        return list(self.request.prompts)

    @property
    def colours(self) -> HeatColours:
        """Of heat-maps."""
        return HeatColours(self.request.colormap, self.request.span)

    @contextmanager
    def renderer(self) -> Iterator[Renderer]:
        """Who draws, with pictures faded and filled as the request has it."""
        fade, fill = self.request.fade, self.request.fill
        with self.renderers() as inner:
            yield Shown(inner, fade=fade, fill=fill) if fade or fill else inner

    @property
    def of_photos(self) -> bool:
        """Whether no view is named, so that every photo's is meant."""
        return self.request.view is None and self.request.camera is None

    def cameras(self) -> list[Camera]:
        """Those that it is seen from: one, or all photos'; as large as the photos that the scene keeps, where
        no size is said.

        Raises:
            ViewError: the scene has no such view.
        """
        choice = self.choice.at_full_size()
        if (self.request.all_views or self.kind.every) and self.of_photos:
            return [choice.of_photo(self.scene, view) for view in range(self.scene.num_views)]
        return [choice.of(self.scene)]

    def targets(self, cameras: Sequence[Camera]) -> tuple[Path, ...]:
        """The file of each camera, or the one of all; nothing else has its name, or that of what lies beside.

        Raises:
            OutputError: one of them cannot be written.
        """
        request, kind = self.request, self.kind
        photos = len(cameras) if request.all_views or kind.every else None
        own = kind.own_files(request.output, photos)
        inputs = [] if request.scene is None else [request.scene]
        for file in own:
            check_output_file(file, inputs=inputs)
            for beside in kind.files_beside(file, photos):
                check_output_file(beside, inputs=inputs)
                if not request.replace:
                    picture_first = beside.suffix == ".json"
                    check_beside(beside, *((beside, file) if picture_first else (file, beside)))
        return own

    def answers(self, cameras: Sequence[Camera], renderer: Renderer) -> Iterator[QueryResult]:
        """View after view; each holds the weight maps of all atoms, so keep only what is needed of it.

        Raises:
            PromptError: a phrase or the threshold cannot be used.
        """
        for index, camera in enumerate(cameras):
            self.progress("drawing", index / len(cameras))
            yield pipeline.query(
                self.scene, self.prompts, camera=camera, threshold=self.request.threshold, render=renderer
            )


def check_found(answers: list[Answers]) -> None:
    """Raises PromptError: no view answers any phrase."""
    if not any(answer.found for view in answers for answer in view):
        asked = ", ".join(answer.prompt for answer in answers[0])
        where = "this view" if len(answers) == 1 else "any view"
        best = max(answer.score for view in answers for answer in view)
        raise PromptError(f"not found in {where}: {asked} (best score {best:.3f}); lower --threshold")
