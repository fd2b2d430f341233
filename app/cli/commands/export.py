"""`langflash export`: a scene, or what answers a phrase, as a file other programs read."""

from argparse import Namespace
from dataclasses import fields
from functools import partial
from typing import TextIO

from langflash_core.base.files import readable_file
from langflash_core.base.outputs import output_of
from langflash_core.base.request import ExportRequest, trim_phrases
from langflash_core.errors import SceneFileError

from ..report import ProgressBar


def run(args: Namespace, out: TextIO) -> None:
    """Write what the ending of -o and the other words say."""
    from langflash_core.writing import prepare_output, write

    from ..renderers import open_renderer
    from ..scenes import open_scene, say_hints

    request = request_of(args)
    prepare_output(request)
    for path in (args.scene, *args.beside):
        readable_file(path, "scene", SceneFileError)
    scene = open_scene(args.scene, request.axes_of(args.scene))
    say_hints(scene, request.prompts, narrowing=_narrows(request))
    with ProgressBar() as progress:
        said = write(scene, request, renderers=partial(open_renderer, args.backend), progress=progress)
    print(f"{args.output}: {said}", file=out)


def _narrows(request: ExportRequest) -> bool:
    """Whether what is written holds what phrases mean; pages and films of heat-maps know heads alone."""
    kind = output_of(request.output, request.what, bool(request.prompts))
    return kind is None or not (kind.subject == "page" or (kind.moves and kind.colours))


def request_of(args: Namespace) -> ExportRequest:
    """What the words ask for; every field of a request is an option of its name."""
    said = {each.name: getattr(args, each.name) for each in fields(ExportRequest) if each.name != "prompts"}
    said |= {"ortho": bool(args.ortho), "beside": tuple(args.beside)}
    return ExportRequest(**said, prompts=tuple(trim_phrases(args.prompt or [])))
