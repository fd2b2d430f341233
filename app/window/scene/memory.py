"""What was computed last about one scene, for the next frame or request to go on from.

The scene as edited is a pure function of scene and marks, and so is what is asked about it; but frames ask
again and again, and a history of moves is long. The memory lies with the scene (`SceneInfo.memory`) and goes
with it. Any thread may ask; at worst two compute the same. Imports torch when it is asked.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

from langflash_core.scene.changes import Change
from langflash_core.scene.edits import Marks

if TYPE_CHECKING:
    from langflash_core.scene.surroundings import Surroundings
    from langflash_core.types import Gaussians, Scene

Answer = TypeVar("Answer")


class SceneMemory:
    """Of `scene`: its Gaussians after the last two lists of changes, and of each question the last answer."""

    def __init__(self, scene: "Scene") -> None:
        self.scene = scene
        self._changed: tuple[tuple[tuple[Change, ...], Gaussians], ...] = ()
        self._answers: dict[str, tuple[tuple, Any]] = {}

    def changed(self, marks: Marks, more: Change | None = None) -> "Scene":
        """The scene with its Gaussians as the marks changed them, every one still in its row.

        more: a change that is not in the marks yet.
        """
        from langflash_core.scene.changed import apply_changes

        gaussians = self._under(marks.changes)
        gaussians = apply_changes(gaussians, () if more is None else (more,))
        return self.scene if gaussians is self.scene.gaussians else replace(self.scene, gaussians=gaussians)

    def answered(self, question: str, about: tuple, ask: Callable[[], Answer]) -> Answer:
        """What `ask` says to a question; the last answer where it is about the same."""
        before = self._answers.get(question)
        if before is not None and before[0] == about:
            return before[1]
        answer = ask()
        self._answers[question] = (about, answer)
        return answer

    def answer_to(self, question: str) -> Any:
        """The last answer; None where nobody asked."""
        return self._answers.get(question, (None, None))[1]

    def surroundings(self) -> "Surroundings | None":
        """What is around a camera in the scene as it came; slow when asked for the first time."""
        from langflash_core.scene.surroundings import surroundings_of

        return self.answered("surroundings", (), lambda: surroundings_of(self.scene))

    def _under(self, changes: tuple[Change, ...]) -> "Gaussians":
        """After all changes, going on from a result that is the beginning of them, where one is there."""
        from langflash_core.scene.changed import apply_changes

        best, start = (), self.scene.gaussians
        for done, result in self._changed:
            if len(done) >= len(best) and changes[: len(done)] == done:
                best, start = done, result
        made = apply_changes(start, changes[len(best) :])
        if len(best) < len(changes) and made is not self.scene.gaussians:
            self._changed = (*self._changed[-1:], (changes, made))
        return made
