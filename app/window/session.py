"""The window itself: glfw, one OpenGL context, ImGui, the worker, and the loop that joins them.

The loop sleeps in glfw until something happens. An event wakes it for a few frames, because
ImGui settles in two or three; flights, held keys and a picture that is still to settle keep it
awake; a resting window draws nothing.
"""

import logging
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import glfw
from imgui_bundle import imgui, implot
from imgui_bundle.python_backends.glfw_backend import GlfwRenderer

from langflash_core.base.graphics import refusals_said
from langflash_core.base.memory import keep_tidy
from langflash_core.errors import LangFlashError

from . import desktop
from .asking.effects import AskingEffects
from .commands import Command, CopyText, Measured, Notify, OfScene, PictureDrawn, ShowPicture, Tick, apply
from .drawing.values import BACKGROUND
from .editing.effects import EditingEffects
from .effects import Effects, Hands, LogEffects, RestEffects, TypedEffects
from .events import Events
from .exporting.effects import ExportingEffects
from .filming.effects import FilmingEffects
from .frame.layout import draw_all
from .inventory.effects import InventoryEffects
from .kit import theme
from .kit.look import Look
from .kit.textures import Thumbnails
from .opening.effects import OpeningEffects
from .recovery import preferences
from .recovery.commands import Prefer
from .recovery.effects import RecoveryEffects
from .recovery.preferences import Preferences
from .recovery.records import Keeper
from .recovery.tiles import TileEffects
from .scene.commands import OpenPaths
from .scene.effects import SceneEffects
from .state import State
from .touring.effects import TouringEffects
from .viewport import Viewport
from .worker import Worker

log = logging.getLogger(__name__)

AWAKE_FRAMES = 3  # frames after an event until ImGui has settled
MOST_AWAKE = 16  # of a burst of events, which ImGui takes in a frame or two each
BLINK_SECONDS = 0.4  # of the text cursor
LONGEST_NAP = 60.0
SWITCH_SECONDS = 0.0005
"""How long the worker may hold the interpreter while a frame waits for it. A frame lets go of it some
dozen times, at every call into OpenGL; at Python's own 5 ms each, frames would take 100 ms more."""


class Session:
    """One open window. `step` draws at most one frame; `run` steps until it is closed.

    Raises:
        GraphicsError: no display, or no OpenGL 3.3.
    """

    def __init__(self, paths: Sequence[str | Path] = (), size: tuple[int, int] | None = None) -> None:
        remembered, complaint = preferences.load()
        sys.setswitchinterval(SWITCH_SECONDS)
        keep_tidy()
        self.state = State()
        self.gl_errors: list[str] = []
        self.lag = 0.0  # seconds that the last step took, without its nap and without drawing the scene
        self._born = time.perf_counter()
        self._inbox: list[Command] = []
        self._awake = AWAKE_FRAMES
        self._viewport_wants = 0.0
        self._touched = 0.0  # when the last event came
        self._frame_seconds = 0.0
        self._panel = (0, 0)
        self._closed = False
        self._window = desktop.open_window(size or desktop.FIRST_SIZE)
        desktop.place(self._window, remembered if size is None else preferences.DEFAULTS)
        glfw.show_window(self._window)
        self._ctx = desktop.create_context()
        imgui.create_context()
        implot.create_context()
        self._scale = desktop.interface_scale(self._window)
        theme.set_up(self._scale * remembered.scale, remembered.theme)
        self._backend = GlfwRenderer(self._window, attach_callbacks=False)
        Events(self._window, self._backend, self._wake, self.dispatch, self._rescale)
        self._thumbnails = Thumbnails(self._ctx)
        self._viewport = Viewport(self._ctx, lambda: self._post(PictureDrawn()))
        self._worker = Worker(glfw.post_empty_event, begins=False)  # loads torch: the first frame is first
        self._renderer_name = desktop.short_name(self._ctx.info["GL_RENDERER"])
        self._effects: tuple[Effects, ...] = ()
        self._begin(remembered, complaint, paths)

    def _begin(self, remembered: Preferences, complaint: str, paths: Sequence[str | Path]) -> None:
        """Every feature's effects, and the first commands."""
        hands = Hands(self._perform, self._post, self._worker.submit, self._worker.cancel, self._now)
        keeper = Keeper()
        recovery = RecoveryEffects(hands, keeper)
        copied = lambda: desktop.clipboard(self._window, "surrogateescape")  # noqa: E731
        entitle = lambda title: glfw.set_window_title(self._window, title)  # noqa: E731
        opening = OpeningEffects(hands, self._thumbnails, copied)
        self._effects = (
            SceneEffects(hands, self._viewport, self._thumbnails, entitle),
            opening,
            AskingEffects(hands, self._viewport),
            EditingEffects(hands, self._viewport),
            recovery,
            TileEffects(hands, self._viewport, self._thumbnails),
            ExportingEffects(hands, keeper),
            FilmingEffects(hands),
            TouringEffects(hands, self._viewport),
            InventoryEffects(hands),
            LogEffects(hands),
            TypedEffects(hands),
            RestEffects(hands),
        )
        opening.begin()
        recovery.begin(remembered, complaint, empty=not paths)
        if paths:
            self.dispatch(OpenPaths(tuple(str(p) for p in paths)))

    # Life

    def run(self) -> int:
        """Step until the window is closed; returns 0."""
        try:
            while not self.should_close:
                self.step()
        except BaseException:
            self.close(crashed=True)
            raise
        self.close()
        return 0

    @property
    def should_close(self) -> bool:
        """Whether the person has asked to leave."""
        return self._closed or self.state.leaving

    def step(self, patience: float | None = None) -> bool:
        """Wait for something to happen, at most `patience` seconds, then draw if it did.

        Returns whether a frame was drawn.
        """
        start = time.perf_counter()
        nap = self._nap() if patience is None else min(patience, self._nap())
        if nap > 0:
            glfw.wait_events_timeout(nap)
        else:
            glfw.poll_events()
        for command in self._worker.poll():
            self.dispatch(command)
        now = self._now()
        for effects in self._effects:
            effects.tick(self.state, now)
        if not self._inbox and not self._due(now):
            return False
        drawing = self._frame(now)
        if imgui.get_frame_count() >= AWAKE_FRAMES:  # what appeared first has found its place by now
            self._worker.begin()
        self.lag = time.perf_counter() - start - nap - drawing
        return True

    def close(self, crashed: bool = False) -> None:
        """Release everything; may be called twice. After a crash the session is kept for the next one."""
        if self._closed:
            return
        wanted = desktop.remembering(self._window, self.state.preferences)
        if wanted != self.state.preferences:
            self._perform(Prefer(wanted))
        self._closed = True
        self._worker.stop()
        for effects in self._effects:
            effects.close(self.state, crashed)
        self._viewport.release()
        self._thumbnails.release()
        self._backend.shutdown()
        implot.destroy_context()
        imgui.destroy_context()
        self._ctx.release()
        glfw.destroy_window(self._window)
        glfw.terminate()

    def dispatch(self, command: Command) -> None:
        """Queue a command for the next frame."""
        self._inbox.append(command)
        self._awake = AWAKE_FRAMES

    def _post(self, command: Command) -> None:
        """Queue a command from any thread."""
        self.dispatch(command)
        glfw.post_empty_event()

    # The loop

    def _now(self) -> float:
        return time.perf_counter() - self._born

    def _wake(self) -> None:
        """An event has come."""
        self._touched = self._now()
        self._awake = min(max(self._awake, AWAKE_FRAMES) + 1, MOST_AWAKE)

    @property
    def _busy(self) -> bool:
        """Whether ImGui is still settling, or has events that it left for another frame."""
        return self._awake > 0 or not imgui.get_current_context().input_events_queue.empty()

    @property
    def _flying(self) -> bool:
        """Whether the camera moves by itself."""
        return self.state.scene.flight is not None or self.state.filming.tour is not None

    def _due(self, now: float) -> bool:
        """Whether the next frame would show something new."""
        blink = imgui.get_io().want_text_input and now - self.state.now >= BLINK_SECONDS
        expired = any(t.until <= now for t in self.state.toasts)
        working = self.state.scene.job is not None and now - self.state.now >= 0.1
        settle = now >= self._viewport_wants
        return self._busy or self._flying or blink or expired or working or settle

    def _nap(self) -> float:
        """Seconds to sleep unless an event comes."""
        if self._busy or self._inbox or self._flying:
            return 0.0
        now = self._now()
        moments = [self._viewport_wants, *(effects.due for effects in self._effects)]
        moments += [t.until for t in self.state.toasts]
        if imgui.get_io().want_text_input:
            moments.append(self.state.now + BLINK_SECONDS)
        if self.state.scene.job is not None:
            moments.append(self.state.now + 0.1)
        return min(max(min(moments) - now, 0.0), LONGEST_NAP)

    def _frame(self, now: float) -> float:
        """Returns the seconds that drawing the scene took."""
        start = time.perf_counter()
        self._awake = max(self._awake - 1, 0)
        taken, self._inbox = self._inbox, []
        for command in (Tick(now), *taken):
            self._perform(command)
        drawing = self._update_picture()
        self._backend.process_inputs()
        imgui.new_frame()
        scale = self._scale * self.state.preferences.scale
        look = Look(scale, self._viewport.texture, self._thumbnails)
        issued, self._panel = draw_all(self.state, look)
        imgui.render()
        self._present()
        self._frame_seconds = time.perf_counter() - start
        if issued:
            self._awake = AWAKE_FRAMES
        for command in issued:
            self._perform(command)
        return drawing

    def _update_picture(self) -> float:
        """Returns the seconds that drawing took."""
        began = time.perf_counter()
        wait = float("inf")
        with self._living():
            for effects in self._effects:
                effects.before_picture(self.state)
            wait = self._viewport.update(self.state, self._panel, self._touched)
        drawing = time.perf_counter() - began
        self._viewport_wants = self._now() + wait
        with self._living():
            for effects in self._effects:
                effects.after_picture(self.state)
        self._perform(Measured(self._viewport.stats(self._frame_seconds, self._renderer_name)))
        return drawing

    def _present(self) -> None:
        self._note_gl_error("picture")  # PyOpenGL would raise it in the middle of the panels
        self._ctx.screen.use()
        self._ctx.clear(*BACKGROUND)
        self._backend.render(imgui.get_draw_data())
        self._note_gl_error("panels")
        glfw.swap_buffers(self._window)

    def _note_gl_error(self, where: str) -> None:
        error = self._ctx.error
        if error != "GL_NO_ERROR":
            log.error("OpenGL error %s after the %s", error, where)
            self.gl_errors.append(f"{error} after the {where}")
        if error == "GL_OUT_OF_MEMORY":
            self._perform(Notify("The graphics card is out of memory; close other programs."))

    # Commands

    def _perform(self, command: Command) -> None:
        """The pure change, then what it asks of the world."""
        if isinstance(command, OfScene):
            if not command.holds(self.state):
                return  # about a scene that is gone
            command = command.command
        before = self.state
        self.state = apply(before, command)
        match command:
            case Prefer() if self.state.preferences != before.preferences:
                self._restyle()
            case CopyText(text):
                glfw.set_clipboard_string(self._window, text)
            case ShowPicture(key, rgb):
                self._thumbnails.put(key, rgb)
            case _:
                pass
        if self.state.dialog != before.dialog:
            self._awake = MOST_AWAKE  # while what is behind it darkens
        for effects in self._effects:
            with self._living():
                effects.follow(command, before, self.state)

    @contextmanager
    def _living(self) -> Iterator[None]:
        """What goes wrong inside is said, also what the graphics driver refuses: edits hang on none of it."""
        try:
            with refusals_said(None, "edits are safe; close other programs, or make this window smaller"):
                yield
        except LangFlashError as error:
            self._perform(Notify(str(error)))

    def _rescale(self) -> None:
        """The window has come to another screen."""
        self._scale = desktop.interface_scale(self._window)
        self._restyle()

    def _restyle(self) -> None:
        chosen = self.state.preferences
        theme.restyle(self._scale * chosen.scale, chosen.theme)
