"""What asking asks of the world: the worker for compiled phrases and scores, the renderer for the picture."""

from dataclasses import replace

from ..commands import Command, Notify
from ..editing.state import Point
from ..effects import Effects, Hands
from ..scene.commands import SceneArrived, room_of
from ..scene.mended import SplitPart
from ..state import State
from ..viewport import Viewport
from .commands import EditPrompt, LoadPrompts, Narrowed, PhrasesCompiled, SavePrompts, SetNegatives
from .lifting import ForgetPhrases, LiftScene, PhrasesTaught, RememberMute, TeachPhrases, can_learn
from .parting import TakePartAt, TakePartOut, at_point, divided, own_atom
from .prompt_sets import PromptSet
from .work import Answer, DescribeAtoms, Encode, ListParts, ReadPrompts, WeighAtoms, WritePrompts

DEBOUNCE_SECONDS = 0.12  # of typing
PARTS_AFTER = 0.4  # seconds, of an answer that stays


class AskingEffects(Effects):
    """Asks what is in force a moment after the last keystroke, and each picture at rest for its scores."""

    def __init__(self, hands: Hands, viewport: Viewport) -> None:
        self._hands = hands
        self._viewport = viewport
        self._encode_at = self._list_at = float("inf")
        self._parted: tuple | None = None  # the answer whose parts are, or will be, listed

    @property
    def due(self) -> float:
        """When the phrases in force are to be compiled, or an answer taken apart."""
        return min(self._encode_at, self._list_at)

    def tick(self, state: State, now: float) -> None:
        """Send the phrases in force to the worker, and the answer to be taken apart."""
        if now >= self._list_at:
            self._list_at = float("inf")
            self._take_apart(state)
        if now < self._encode_at:
            return
        self._encode_at = float("inf")
        info, asked = state.scene.info, state.asking.asked
        if info is None or info.num_atoms == 0 or not asked:
            self._viewport.ask((), None)
            return
        keys, texts = tuple(p.key for p in asked), tuple(p.text.strip() for p in asked)
        likes, marks = tuple(p.like for p in asked), state.editing.marks
        scene, revision = (info.serial, info.scene), state.asking.revision
        self._hands.submit(Encode(*scene, keys, texts, state.asking.negatives, likes, marks, revision))

    def _take_apart(self, state: State) -> None:
        info, marks, prompt = state.scene.info, state.editing.marks, divided(state)
        if info is not None and marks is not None and prompt is not None and _answer(state) == self._parted:
            negatives = state.asking.negatives
            self._hands.submit(
                ListParts(info.serial, info.memory, marks, prompt.text.strip(), negatives, prompt.cut)
            )

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
            case PhrasesCompiled(keys, query, revision):
                self._viewport.ask(keys, query, revision)
            case Narrowed(name, relevance):
                self._viewport.narrow(name, relevance)
            case TakePartOut(text, part) if state.scene.job is not None and own_atom(before, part) is None:
                info, marks = state.scene.info, state.editing.marks
                if info is not None and marks is not None:
                    submit(SplitPart(info, marks, part.rows, text))
            case TakePartAt(at):
                self._take_at(at, state)
            case TeachPhrases() if can_learn(before):
                info, marks = state.scene.info, state.editing.marks
                if info is not None and marks is not None:
                    submit(LiftScene(info, marks))
            case PhrasesTaught() if command.fits(before):
                self._take_taught(command, before)
            case ForgetPhrases() if before.scene.mute is not None:
                mute = before.scene.mute
                back = replace(mute.info, history=mute.history)
                self._hands.perform(SceneArrived(back, room=mute, replaces=True))
            case _:
                self._weigh(before, state)
        self._list(before, state)
        if _question(before) != _question(state):
            pause = DEBOUNCE_SECONDS if isinstance(command, EditPrompt | SetNegatives) else 0.0
            self._encode_at = self._hands.now() + pause

    def _take_taught(self, command: PhrasesTaught, before: State) -> None:
        """Show it, and remember what was on show."""
        assert before.scene.info is not None
        self._hands.perform(command.arrival(before))
        self._hands.perform(RememberMute(room_of(before, before.scene.info)))
        self._hands.perform(Notify("It answers phrases now. Ctrl+Z takes that back.", "info"))

    def _take_at(self, at: Point, state: State) -> None:
        """The part that a click means."""
        read = self._viewport.read(at)
        if divided(state) is None or read is None or read[0].point is None:
            return
        command = at_point(state, read[0].point)
        if command is None:
            text = "There is no part of the answer there; Ctrl+click one of its parts."
            self._hands.perform(Notify(text, "info"))
        else:
            self._hands.perform(command)

    def _list(self, before: State, state: State) -> None:
        """Have the answer taken apart a moment after it has become another."""
        same = state.asking is before.asking and state.editing.marks is before.editing.marks
        about = None if same and state.scene.info is before.scene.info else _answer(state)
        if about is not None and about != self._parted:
            self._parted = about
            self._list_at = self._hands.now() + PARTS_AFTER

    def _weigh(self, before: State, state: State) -> None:
        """Have the atoms weighed again once something was deleted or is back."""
        old, new, info = before.editing.marks, state.editing.marks, state.scene.info
        if info is None or info is not before.scene.info or old is None or new is None or new is old:
            return
        if info.num_atoms and (old.there, old.deleted, old.changes) != (new.there, new.deleted, new.changes):
            self._hands.submit(WeighAtoms(info.serial, info.scene, new))

    def after_picture(self, state: State) -> None:
        """Have the view on show scored, once it rests."""
        view = self._viewport.view(state)
        if view is not None:
            self._hands.submit(Answer(view.serial, view))


def _answer(state: State) -> tuple | None:
    """What the parts of the active phrase's answer depend on; None before it is answered."""
    info, marks, prompt = state.scene.info, state.editing.marks, divided(state)
    if info is None or marks is None or prompt is None or not prompt.found:
        return None
    about = info.serial, prompt.text.strip(), prompt.cut, state.asking.negatives
    return *about, marks.there, marks.deleted, marks.changes, marks.atoms


def _question(state: State) -> tuple:
    """What an encoding depends on."""
    serial = state.scene.info.serial if state.scene.info else 0
    return serial, tuple((p.key, p.text.strip(), p.like) for p in state.asking.asked), state.asking.revision
