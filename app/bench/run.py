"""Cases measured from end to end, in a context of their own."""

from collections.abc import Collection, Sequence

from langflash_core.base.graphics import COMPUTE
from langflash_core.base.running import Progress

from ..gl import offscreen_context
from .cases import Case
from .machine import machine
from .measure import measure
from .modes import AXES, modes_for
from .report import document


def measured_cases(cases: Sequence[Case], axes: Collection[str] | None, progress: Progress) -> dict:
    """The document of `report.document`.

    Args:
        axes: of `modes.AXES`, None: all.

    Raises:
        GraphicsError: there is no OpenGL, or a picture is larger than its textures.
    """
    context = offscreen_context()
    results = []
    try:
        for number, case in enumerate(cases):

            def told(stage: str, share: float, number: int = number) -> None:
                progress(stage, (number + share) / len(cases))

            modes = modes_for(case.scene, axes or AXES, context.version_code >= COMPUTE)
            results.append(measure(context, case, modes, told))
        return document(machine(context), results)
    finally:
        context.release()
