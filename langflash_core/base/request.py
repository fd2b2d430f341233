"""One order of a file, as API, command line, batch and window hand it over; read without torch.

What it may say is checked here, once, against the table of `outputs.py`: a sentence and a remedy for words
that do not go together. `words` are what the command line calls the same.
"""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from langflash_core.base.detail import EXPORT_DETAILS
from langflash_core.base.formats import COLOUR_MAPS, kind_of
from langflash_core.base.outputs import OUTPUTS, SEGMENTED, Output, endings_of, output_of
from langflash_core.errors import InputError, PromptError


@dataclass(frozen=True)
class ExportRequest:
    """What to write of a scene, where, and how it is seen.

    output: the file, or with `segmented` the folder. scene: the scene's own file, which is never written
    over; it also names a page. what: a word of `--what`; None: what the ending stands for. prompts: phrases.
    threshold: relevance to keep, in (0, 1); None: the calibrated one. view: a photo's camera, from 0.
    camera: a JSON file of one. all_views: from every photo. size: (width, height), pixels. ortho: parallel
    rays. fade: leave out what no photo looked at. fill: fill gaps. colormap, span: of heat-maps. detail: of
    Gaussians and pages. seconds, path: of a film, its length and "photos", "orbit", "tour" or a file of key
    frames. with_text: a page answers any phrase. beside: files of other scenes in the same page. upright:
    Gaussians stand in the scene's world, in metres where they are known. axes: of every .spz that is read or
    written, one of `formats.AXES`. replace: also what is there as
    something else. backend: "gl", "torch" or None.
    """

    output: Path
    scene: Path | None = None
    what: str | None = None
    segmented: bool = False
    prompts: tuple[str, ...] = ()
    threshold: float | None = None
    view: int | None = None
    camera: Path | None = None
    all_views: bool = False
    size: tuple[int, int] | None = None
    ortho: bool = False
    fade: bool = False
    fill: bool = False
    colormap: str = COLOUR_MAPS[0]
    span: tuple[float, float] | None = None
    detail: str = EXPORT_DETAILS[0]
    seconds: float | None = None
    path: str | None = None
    with_text: bool = False
    beside: tuple[Path, ...] = ()
    upright: bool = False
    axes: str | None = None
    replace: bool = False
    backend: str | None = None

    @property
    def _found(self) -> Output | None:
        """What is written; None where no file of this name holds it."""
        return SEGMENTED if self.segmented else output_of(self.output, self.what, bool(self.prompts))

    @property
    def kind(self) -> Output:
        """What is written.

        Raises:
            InputError: no file of this name holds it.
        """
        found = self._found
        if found is None:
            ends = " or ".join(endings_of(self.what) if self.what else ())
            raise InputError(f"--what {self.what} takes a {ends}; name one instead of {self.output.name}")
        return found

    @property
    def looked_from(self) -> list[str]:
        """What is said of the camera, as the command line calls it."""
        said = [name for name in ("view", "camera", "size") if getattr(self, name) is not None]
        return [*said, *(name for name in ("ortho",) if self.ortho)]

    def axes_of(self, path: Path) -> str | None:
        """What is told of the axes of a file."""
        return self.axes if kind_of(path) == ".spz" else None

    def words(self) -> list[str]:
        """The words after `langflash` that ask for the same."""
        words = ["export", str(self.scene), "-o", str(self.output)]
        words += ["--segmented"] if self.segmented else []
        for name in ("what", "threshold", "view", "camera", "size", "backend", "seconds", "path", "axes"):
            value = getattr(self, name)
            said = value + 1 if name == "view" and value is not None else value  # people count from 1
            words += [] if value is None else [f"--{name}", _as_argument(said)]
        words += [] if self.colormap == COLOUR_MAPS[0] else ["--colormap", self.colormap]
        if self.span is not None:  # in one word where it begins like an option
            low_high = _as_argument(self.span)
            words += [f"--span={low_high}"] if low_high.startswith("-") else ["--span", low_high]
        words += [] if self.detail == EXPORT_DETAILS[0] else ["--detail", self.detail]
        for name in ("all_views", "fade", "fill", "ortho", "with_text", "upright", "replace"):
            words += [f"--{name.replace('_', '-')}"] if getattr(self, name) else []
        words += ["--beside", *map(str, self.beside)] if self.beside else []
        return [*words, *(["--prompt", *self.prompts] if self.prompts else [])]

    @property
    def line(self) -> str:
        """To paste into a shell."""
        return shlex.join(("langflash", *self.words()))

    def check(self) -> Output:
        """What is written, where all that is said goes together.

        Raises:
            InputError: says what does not.
        """
        if self.segmented and (not self.prompts or self.what is not None):
            raise PromptError('--segmented needs phrases and no --what; add --prompt "armchair"')
        _check_phrases(self)
        kind = self.kind
        _check_options(self, kind)
        _check_camera(self, kind)
        return kind


def trim_phrases(prompts: Sequence[str]) -> list[str]:
    """Phrases without the white space around them.

    Raises:
        PromptError: one is empty.
    """
    phrases = [" ".join(prompt.split()) for prompt in prompts]
    if not all(phrases):
        raise PromptError('a prompt is empty; give a phrase such as "armchair"')
    return phrases


def _as_argument(value: object) -> str:
    """A value as the command line reads it."""
    if isinstance(value, tuple):
        return ("x" if isinstance(value[0], int) else ",").join(map(_as_argument, value))
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


def _check_phrases(request: ExportRequest) -> None:
    """Raises:
    PromptError: there are too few or too many for what is wanted, also where its file's ending is wrong.
    """
    if request.threshold is not None and not request.prompts:
        raise PromptError('--threshold needs a phrase; add --prompt "armchair"')
    wanted = request._found or next(output for output in OUTPUTS if output.word == request.what)
    said = f"--what {request.what}" if request.what else wanted.noun
    if wanted.needs_phrases and not request.prompts:
        raise PromptError(f'{said} needs a phrase; add --prompt "armchair"')
    if wanted.phrases == "one" and len(request.prompts) > 1:
        raise PromptError(f"{said} draws one phrase; use --what labels for several")
    if wanted.phrases == "none" and request.prompts:
        raise PromptError(f"{said} takes no --prompt; use --what cutout, mask, heat or labels")


def _check_options(request: ExportRequest, kind: Output) -> None:
    for name in ("seconds", "path"):
        if getattr(request, name) is not None and not kind.moves:
            raise InputError(f"--{name} is for videos; name an .mp4 or .webp, or leave it out")
    if not kind.colours and (request.span is not None or request.colormap != COLOUR_MAPS[0]):
        raise InputError("--colormap and --span colour heat-maps; add --what heat, or leave them out")
    for name in ("with_text", "beside"):
        if getattr(request, name) and kind.subject != "page":
            raise InputError(f"--{name.replace('_', '-')} is for web pages; name an .html, or leave it out")
    if request.detail == "low" and not kind.splats:
        raise InputError("--detail low is for splats, scenes and web pages; name one, or leave it out")
    if request.upright and kind.subject not in ("scene", "photos"):
        raise InputError("--upright is for splats, scenes and poses of photos; name one, or leave it out")
    read = (*filter(None, [request.scene]), *request.beside)
    if request.axes and not any(map(request.axes_of, (request.output, *read))):
        raise InputError("--axes is for .spz files, read or written; name one, or leave it out")
    if request.fill and not (kind.fills and (kind.phrases == "one" or not request.prompts)):
        raise InputError("--fill is for pictures and films of the whole scene and heat-maps; leave it out")


def _check_camera(request: ExportRequest, kind: Output) -> None:
    looked_from = request.looked_from
    if request.all_views:
        if request.segmented:
            raise InputError("--segmented looks from every photo by itself; leave --all-views out")
        if set(looked_from) - {"size", "ortho"}:
            raise InputError(f"--all-views looks from every photo; leave --{looked_from[0]} out")
        looked_from.append("all-views")
    ending = kind_of(request.output)
    if not kind.sized and looked_from:
        raise InputError(f"a {ending} holds what all views show, not one; leave --{looked_from[0]} out")
    if not kind.sized and request.fade:
        raise InputError(f"a {ending} holds the whole scene, and only views fade; leave --fade out")
    extra = [name for name in looked_from if name != "size"]
    if kind.moves and extra:
        raise InputError(f"a video moves by itself; leave --{extra[0]} out, or say --path")
