"""What asking asks of the world: the worker for compiled phrases and scores, the renderer for the picture."""

from ..commands import Command
from ..effects import Effects, Hands
from ..scene.commands import SceneArrived
from ..state import State
from ..viewport import Viewport
from .commands import EditPrompt, LoadPrompts, PhrasesCompiled, SavePrompts, SetNegatives
from .prompt_sets import PromptSet
from .work import Answer, DescribeAtoms, Encode, ReadPrompts, WeighAtoms, WritePrompts

DEBOUNCE_SECONDS = 0.12  # of typing


class AskingEffects(Effects):
    """Asks what is in force a moment after the last keystroke, and each picture at rest for its scores."""

    def __init__(self, hands: Hands, viewport: Viewport) -> None:
        self._hands = hands
        self._viewport = viewport
        self._encode_at = float("inf")

    @property
    def due(self) -> float:
        """When the phrases in force are to be compiled."""
        return self._encode_at

    def tick(self, state: State, now: float) -> None:
        """Send the phrases in force to the worker."""
        if now < self._encode_at:
            return
        self._encode_at = float("inf")
        info, asked = state.scene.info, state.asking.asked
        if info is None or info.num_atoms == 0 or not asked:
            self._viewport.ask((), None)
            return
        keys, texts = tuple(p.key for p in asked), tuple(p.text.strip() for p in asked)
        likes, marks = tuple(p.like for p in asked), state.editing.marks
        scene, lapses = (info.serial, info.scene), state.asking.lapses
        self._hands.submit(Encode(*scene, keys, texts, state.asking.negatives, likes, marks, lapses))

    def follow(self, command: Command, before: State, state: State) -> None:
        """Prompt sets to the disk and from it; compiled phrases to the renderer."""
        submit = self._hands.submit
        match command:
            case SceneArrived(info):
                submit(DescribeAtoms(info.serial, info.scene, state.editing.marks))
            case SavePrompts(path):
                submit(WritePrompts(PromptSet(state.asking.prompts, state.asking.negatives), path))
            case LoadPrompts(path):
                submit(ReadPrompts(path))
            case PhrasesCompiled(keys, query, lapses):
                self._viewport.ask(keys, query, lapses)
            case _:
                self._weigh(before, state)
        if _question(before) != _question(state):
            pause = DEBOUNCE_SECONDS if isinstance(command, EditPrompt | SetNegatives) else 0.0
            self._encode_at = self._hands.now() + pause

    def _weigh(self, before: State, state: State) -> None:
        """Have the atoms weighed again once something was deleted or is back."""
        old, new, info = before.editing.marks, state.editing.marks, state.scene.info
        if info is None or info is not before.scene.info or old is None or new is None:
            return
        if info.num_atoms and (old.left, old.changes) != (new.left, new.changes):
            self._hands.submit(WeighAtoms(info.serial, info.scene, new))

    def after_picture(self, state: State) -> None:
        """Have the view on show scored, once it rests."""
        view = self._viewport.view(state)
        if view is not None:
            seen = (view.relevance, view.frame, view.camera, view.query)
            self._hands.submit(Answer(view.serial, view.keys, *seen, view.lapses))


def _question(state: State) -> tuple:
    """What an encoding depends on."""
    serial = state.scene.info.serial if state.scene.info else 0
    return serial, tuple((p.key, p.text.strip(), p.like) for p in state.asking.asked), state.asking.lapses
