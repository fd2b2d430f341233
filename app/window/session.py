"""The window itself: glfw, one OpenGL context, ImGui, the worker, and the loop that joins them.

The loop sleeps in glfw until something happens. An event wakes it for a few frames, because
ImGui settles in two or three; flights, held keys and a picture that is still to settle keep it
awake; a resting window draws nothing.
"""

import ctypes
import logging
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import glfw
import moderngl
from imgui_bundle import imgui, implot
from imgui_bundle.python_backends.glfw_backend import GlfwRenderer

from app.window import ask_commands as ask
from app.window import ask_messages, desktop, edit_messages, messages, preferences, theme
from app.window import commands as do
from app.window import desk_commands as desk
from app.window import edit_commands as edit
from app.window.citizen import Citizen
from app.window.drops import sort_drop
from app.window.editor import Editor
from app.window.panels import Look, draw_all
from app.window.panels.canvas import EDIT_SHORTCUTS, SHORTCUTS
from app.window.prompt_sets import PromptSet
from app.window.state import State, Stats
from app.window.textures import Thumbnails
from app.window.viewport import BACKGROUND, Viewport
from app.window.worker import Worker
from langflash_core.errors import GraphicsError, LangFlashError

log = logging.getLogger(__name__)

AWAKE_FRAMES = 3  # frames after an event until ImGui has settled
MOST_AWAKE = 16  # of a burst of events, which ImGui takes in a frame or two each
DEBOUNCE_SECONDS = 0.12  # of typing
BLINK_SECONDS = 0.4  # of the text cursor
LONGEST_NAP = 60.0
COLORMAPS = ("turbo", "inferno")  # of colour-bars
MODIFIERS = frozenset(
    (glfw.KEY_LEFT_CONTROL, glfw.KEY_RIGHT_CONTROL, glfw.KEY_LEFT_SUPER, glfw.KEY_RIGHT_SUPER)
)
SWITCH_SECONDS = 0.0005
"""How long the worker may hold the interpreter while a frame waits for it. A frame lets go of it some
dozen times, at every call into OpenGL; at Python's own 5 ms each, frames would take 100 ms more."""
MIN_SIZE = (900, 560)  # design pixels; below this the panels would overlap


class GlfwLoader:
    """Hands moderngl the functions of the context that glfw made, whatever the platform.

    moderngl's own loader guesses between EGL and GLX and offers no `load` for the rest.
    """

    def load(self, name: str) -> int:
        """The address of an OpenGL function; 0 when there is none."""
        return ctypes.cast(glfw.get_proc_address(name), ctypes.c_void_p).value or 0

    load_opengl_function = load

    def release(self) -> None:
        """Nothing to do: the window owns the context."""


# moderngl's annotations know keyword settings only as dictionaries.
_LOADER: dict[str, Any] = {"context": GlfwLoader()}


class Session:
    """One open window. `step` draws at most one frame; `run` steps until it is closed.

    Raises:
        GraphicsError: no display, or no OpenGL 3.3.
    """

    def __init__(self, paths: Sequence[str | Path] = (), size: tuple[int, int] | None = None) -> None:
        remembered, complaint = preferences.load()
        sys.setswitchinterval(SWITCH_SECONDS)
        self.state = State()
        self.gl_errors: list[str] = []
        self.lag = 0.0  # seconds that the last step took, without its nap and without drawing the scene
        self._born = time.perf_counter()
        self._inbox: list[do.Command] = []
        self._awake = AWAKE_FRAMES
        self._encode_at = float("inf")
        self._viewport_wants = 0.0
        self._touched = 0.0  # when the last event came
        self._frame_seconds = 0.0
        self._panel = (0, 0)
        self._closed = False
        self._window = _open_window(size or desktop.size_of(remembered))
        if size is None:
            desktop.place(self._window, remembered)
        self._ctx = moderngl.create_context(require=330, **_LOADER)
        imgui.create_context()
        implot.create_context()
        self._scale = _interface_scale(self._window)
        theme.set_up(self._scale * remembered.scale, remembered.theme)
        self._backend = GlfwRenderer(self._window, attach_callbacks=False)
        self._attach()
        self._thumbnails = Thumbnails(self._ctx)
        self._viewport = Viewport(self._ctx)
        self._worker = Worker(glfw.post_empty_event, begins=False)  # loads torch: the first frame is first
        self._renderer_name = _short_name(self._ctx.info["GL_RENDERER"])
        self._editor = Editor(self._worker.submit, self._viewport, self._perform)
        self._citizen = Citizen(self._perform, self._post, self._worker.submit)
        self._citizen.begin(remembered, complaint)
        if paths:
            self.dispatch(do.OpenPaths(tuple(str(p) for p in paths)))
        elif self.state.desk.offer is None:  # a session holds its edits
            self._worker.submit(edit_messages.LookForEdits(0))

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
        for result in self._worker.poll():
            self._hear(result)
        now = self._now()
        if now >= self._encode_at:
            self._encode()
        self._editor.keep_if_due(self.state, now)
        self._citizen.tick(self.state, now)
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
        self._remember_window()
        self._closed = True
        self._worker.stop()
        self._editor.close(self.state)
        self._citizen.close(self.state, crashed)
        self._viewport.release()
        self._thumbnails.release()
        self._backend.shutdown()
        implot.destroy_context()
        imgui.destroy_context()
        self._ctx.release()
        glfw.destroy_window(self._window)
        glfw.terminate()

    def dispatch(self, command: do.Command) -> None:
        """Queue a command for the next frame."""
        self._inbox.append(command)
        self._awake = AWAKE_FRAMES

    def _post(self, command: do.Command) -> None:
        """Queue a command from any thread."""
        self.dispatch(command)
        glfw.post_empty_event()

    def _remember_window(self) -> None:
        wanted = desktop.remembering(self._window, self.state.desk.preferences)
        if wanted != self.state.desk.preferences:
            self._perform(desk.Prefer(wanted))

    # The loop

    def _now(self) -> float:
        return time.perf_counter() - self._born

    def _due(self, now: float) -> bool:
        """Whether the next frame would show something new."""
        blink = imgui.get_io().want_text_input and now - self.state.now >= BLINK_SECONDS
        expired = any(t.until <= now for t in self.state.toasts)
        working = self.state.job is not None and now - self.state.now >= 0.1
        settle = now >= self._viewport_wants
        return self._awake > 0 or self.state.flight is not None or blink or expired or working or settle

    def _nap(self) -> float:
        """Seconds to sleep unless an event comes."""
        if self._awake > 0 or self._inbox or self.state.flight is not None:
            return 0.0
        now = self._now()
        moments = [self._viewport_wants, self._encode_at, self._editor.keep_at, self._citizen.due]
        moments += [t.until for t in self.state.toasts]
        if imgui.get_io().want_text_input:
            moments.append(self.state.now + BLINK_SECONDS)
        if self.state.job is not None:
            moments.append(self.state.now + 0.1)
        return min(max(min(moments) - now, 0.0), LONGEST_NAP)

    def _frame(self, now: float) -> float:
        """Returns the seconds that drawing the scene took."""
        start = time.perf_counter()
        self._awake = max(self._awake - 1, 0)
        for command in (do.Tick(now), *self._take()):
            self._perform(command)
        drawing = self._update_picture(now)
        self._backend.process_inputs()
        imgui.new_frame()
        scale = self._scale * self.state.desk.preferences.scale
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

    def _take(self) -> list[do.Command]:
        taken, self._inbox = self._inbox, []
        return taken

    def _update_picture(self, now: float) -> float:
        """Returns the seconds that drawing took."""
        began = time.perf_counter()
        try:
            self._editor.mark(self.state)
            wait = self._viewport.update(self.state, self._panel, self._touched)
        except LangFlashError as error:
            self._perform(do.Notify(str(error)))
            wait = float("inf")
        drawing = time.perf_counter() - began
        self._viewport_wants = self._now() + wait
        self._editor.point(self.state)
        view = self._viewport.view(self.state)
        if view is not None:
            self._worker.submit(
                messages.Answer(view.serial, view.keys, view.relevance, view.frame, view.camera, view.query)
            )
        stats = Stats(
            self._frame_seconds,
            self._viewport.picture_seconds,
            self._viewport.picture_size,
            self._renderer_name,
            self._viewport.depth_range,
            self._viewport.passes,
        )
        self._perform(do.Measured(stats))
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

    # Commands that touch the world

    def _perform(self, command: do.Command) -> None:
        """The pure change, then what it asks of the world."""
        before = self.state
        self.state = do.apply(before, command)
        match command:
            case do.OpenPaths(paths):
                self._open(paths)
            case desk.Prefer() if self.state.desk.preferences != before.desk.preferences:
                chosen = self.state.desk.preferences
                theme.restyle(self._scale * chosen.scale, chosen.theme)
            case do.AddPhotos(paths):
                self._worker.submit(messages.MakeThumbnails(paths))
            case do.Reconstruct() if self.state.photos:
                photos = self.state.photos
                paths, fovs = tuple(p.path for p in photos), tuple(p.fov for p in photos)
                self._worker.submit(messages.ReconstructPhotos(paths, fovs))
            case do.OpenScene(path, edits):
                self._worker.submit(messages.LoadScene(path, edits))
            case do.SaveScene(path) if self.state.info is not None:
                marks = self.state.editing.marks
                self._worker.submit(messages.WriteScene(self.state.info.scene, path, marks))
            case do.CancelJob():
                self._worker.cancel()
            case do.CopyText(text):
                glfw.set_clipboard_string(self._window, text)
            case do.SceneArrived(info):
                self._show_scene(info)
            case ask.SavePrompts(path):
                chosen = PromptSet(self.state.prompts, self.state.negatives)
                self._worker.submit(ask_messages.WritePrompts(chosen, path))
            case ask.LoadPrompts(path):
                self._worker.submit(ask_messages.ReadPrompts(path))
            case _:
                pass
        if self.state.dialog != before.dialog:
            self._awake = MOST_AWAKE  # while what is behind it darkens
        self._editor.follow(command, before, self.state)
        self._citizen.follow(command, before, self.state)
        if _question(before) != _question(self.state):
            pause = DEBOUNCE_SECONDS if isinstance(command, do.EditPrompt | do.SetNegatives) else 0.0
            self._encode_at = self._now() + pause

    def _open(self, paths: Sequence[str]) -> None:
        drop = sort_drop(paths)
        for sentence in drop.rejected:
            self._perform(do.Notify(sentence))
        if drop.photos:
            self._perform(do.AddPhotos(drop.photos))
            if self.state.desk.preferences.start_at_once:
                self._perform(do.Reconstruct())
        elif drop.scenes:
            self._perform(do.OpenScene(drop.scenes[0]))

    def _show_scene(self, info) -> None:
        try:
            self._viewport.set_scene(info.serial, info.scene)
        except LangFlashError as error:
            self._perform(do.Notify(str(error)))
        for index, photo in enumerate(info.scene.photos):
            with suppress(OSError):  # a scene whose small photos are damaged still shows; buttons get numbers
                self._thumbnails.put_encoded(f"view {index}", photo)
        for colormap in COLORMAPS:
            self._thumbnails.put(f"bar {colormap}", self._viewport.colour_bar(colormap))
        self._worker.submit(ask_messages.DescribeAtoms(info.serial, info.scene))
        glfw.set_window_title(self._window, f"{info.name} - LangFlash")

    def _encode(self) -> None:
        """Send the prompts in force to the worker."""
        self._encode_at = float("inf")
        info, asked = self.state.info, self.state.asked
        if info is None or info.num_atoms == 0 or not asked:
            self._viewport.ask((), None)
            return
        keys, texts = tuple(p.key for p in asked), tuple(p.text.strip() for p in asked)
        likes, marks = tuple(p.like for p in asked), self.state.editing.marks
        negatives = self.state.negatives
        self._worker.submit(messages.Encode(info.serial, info.scene, keys, texts, negatives, likes, marks))

    # Results of the worker

    def _hear(self, result: messages.Result) -> None:
        serial = self.state.info.serial if self.state.info else 0
        self._citizen.hear(result, serial)
        self._awake = AWAKE_FRAMES
        match result:
            case messages.Progress(stage, fraction):
                self.dispatch(do.Progressed(stage, fraction))
            case messages.SceneReady(info):
                self.dispatch(do.SceneArrived(info))
            case messages.SceneWritten(path, marks):
                self.dispatch(do.SceneSaved(path, marks))
            case messages.Failed(sentence, job):
                self.dispatch(do.JobFailed(sentence) if job else do.Notify(sentence))
                self.dispatch(edit.StopWaiting())
            case messages.Stopped():
                self.dispatch(do.JobCancelled())
            case messages.Compiled(of, keys, query) if of == serial:
                self._viewport.ask(keys, query)
                self.dispatch(do.Calibrated(query.threshold))
            case messages.Scored(of, scores) if of == serial:
                self.dispatch(do.Answered(scores))
            case ask_messages.Histograms(of, histograms) if of == serial:
                self.dispatch(ask.Binned(histograms))
            case ask_messages.PromptsLoaded(path, chosen):
                self.dispatch(ask.PromptsRead(path, chosen))
            case ask_messages.PromptsWritten(path):
                self.dispatch(do.Notify(f"Saved {path}", "info"))
            case ask_messages.Described(of, insight, pictures) if of == serial:
                for k, rgb in enumerate(pictures):
                    if rgb is not None:
                        self._thumbnails.put(f"atom {k}", rgb)
                self.dispatch(ask.AtomsDescribed(insight))
            case messages.Thumbnail(key, rgb, problem):
                if rgb is None:
                    self.dispatch(do.PhotoFailed(Path(key), problem))
                else:
                    self._thumbnails.put(key, rgb)
            case edit_messages.SelectionFound(of, mask, combine, what) if of == serial:
                self.dispatch(edit.Found(mask, combine, what))
            case edit_messages.FloatersScored(of, scores) if of == serial:
                self.dispatch(edit.FloatersFound(scores))
            case edit_messages.Weighed(of, reading) if of == serial:
                self.dispatch(edit.ReadingTaken(reading))
            case edit_messages.PlaceNamed(of, asked, reading, words, vector) if of == serial:
                self.dispatch(edit.Named(asked, reading, words, vector))
            case edit_messages.AtomWords(of, names) if of == serial:
                self.dispatch(edit.AtomsNamed(names))
            case edit_messages.EditsFound(of, offer) if of == serial:
                self.dispatch(edit.OfferEdits(offer))
            case edit_messages.EditsKept(of, file) if of == serial:
                self.dispatch(edit.EditsKept(file))
            case _:
                pass  # an answer about a scene that is gone

    # glfw

    def _attach(self) -> None:
        """Callbacks: wake the loop, then hand the event to ImGui."""
        window, backend = self._window, self._backend

        def waking(callback):
            def wake(*event):
                self._touched = self._now()
                self._awake = min(max(self._awake, AWAKE_FRAMES) + 1, MOST_AWAKE)
                callback(*event)

            return wake

        def move(_window, x, y):
            backend.io.add_mouse_pos_event(x, y)

        def leave(_window, entered):
            if not entered:
                backend.io.add_mouse_pos_event(-imgui.FLT_MAX, -imgui.FLT_MAX)

        def focus(_window, has):
            backend.io.add_focus_event(bool(has))

        glfw.set_key_callback(window, waking(self._key))
        glfw.set_char_callback(window, waking(backend.char_callback))
        glfw.set_cursor_pos_callback(window, waking(move))
        glfw.set_cursor_enter_callback(window, waking(leave))
        glfw.set_mouse_button_callback(window, waking(backend.mouse_button_callback))
        glfw.set_scroll_callback(window, waking(backend.scroll_callback))
        glfw.set_window_size_callback(window, waking(backend.resize_callback))
        glfw.set_window_refresh_callback(window, waking(lambda _window: None))
        glfw.set_window_focus_callback(window, waking(focus))
        glfw.set_window_close_callback(window, waking(self._asked_to_close))
        glfw.set_drop_callback(window, waking(self._dropped))
        glfw.set_window_content_scale_callback(window, waking(self._moved_to_another_screen))
        imgui.get_platform_io().platform_get_clipboard_text_fn = lambda _ctx: _clipboard(window)

    def _key(self, window, key: int, scancode: int, action: int, mods: int) -> None:
        """Shortcuts by the letter that the keyboard's layout puts there; the rest is ImGui's."""
        if action == glfw.PRESS and mods & (glfw.MOD_CONTROL | glfw.MOD_SUPER):
            letter = glfw.get_key_name(key, scancode)
            edits = EDIT_SHORTCUTS.get((letter or "", bool(mods & glfw.MOD_SHIFT)))
            if edits is not None and not imgui.get_io().want_text_input and not self.state.dialog:
                self.dispatch(edits)
                return
            if letter in SHORTCUTS:
                self.dispatch(SHORTCUTS[letter])
                return
        if action == glfw.RELEASE and key in MODIFIERS:
            # ImGui would take Ctrl+A and the release of Ctrl, come in one frame, for a bare A. It ends a
            # frame's events before a key that changes twice, so one that no keyboard has parts the two.
            for down in (True, False):
                self._backend.io.add_key_event(imgui.Key.f24, down)
        self._backend.keyboard_callback(window, key, scancode, action, mods)

    def _moved_to_another_screen(self, window, _x: float, _y: float) -> None:
        self._scale = _interface_scale(window)
        chosen = self.state.desk.preferences
        theme.restyle(self._scale * chosen.scale, chosen.theme)

    def _asked_to_close(self, window) -> None:
        """The close button asks before an unsaved scene is lost, as Ctrl+Q does."""
        glfw.set_window_should_close(window, False)
        self.dispatch(do.Leave())

    def _dropped(self, _window, paths: Sequence[str]) -> None:
        self.dispatch(do.OpenPaths(tuple(paths)))


def _question(state: State) -> tuple:
    """What an encoding depends on."""
    serial = state.info.serial if state.info else 0
    atoms = state.editing.marks.atoms if state.editing.marks else ()
    return serial, tuple((p.key, p.text.strip(), p.like) for p in state.asked), state.negatives, atoms


def _open_window(size: tuple[int, int]):
    problems: list[str] = []
    previous = glfw.ERROR_REPORTING
    glfw.ERROR_REPORTING = "ignore"
    try:
        glfw.set_error_callback(lambda _code, text: problems.append(_text(text)))
        if not glfw.init():
            raise GraphicsError(
                "there is no display to open a window on; use langflash render or query, or make run"
            )
        window = _create(size)
        if not window:
            why = f" ({problems[-1]})" if problems else ""
            glfw.terminate()
            raise GraphicsError(f"OpenGL 3.3 is not available here{why}; update the graphics driver")
    finally:
        glfw.ERROR_REPORTING = previous
    glfw.set_error_callback(lambda code, text: log.warning("glfw %s: %s", code, _text(text)))
    glfw.make_context_current(window)
    glfw.swap_interval(1)
    return window


def _create(size: tuple[int, int]):
    hints = {
        glfw.CONTEXT_VERSION_MAJOR: 3,
        glfw.CONTEXT_VERSION_MINOR: 3,
        glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
        glfw.OPENGL_FORWARD_COMPAT: True,
        glfw.SCALE_TO_MONITOR: True,
        glfw.DEPTH_BITS: 0,
        glfw.STENCIL_BITS: 0,
    }
    for hint, value in hints.items():
        glfw.window_hint(hint, value)
    window = glfw.create_window(*size, "LangFlash", None, None)
    if window:
        scale = _interface_scale(window)
        width, height = (round(scale * side) for side in MIN_SIZE)
        glfw.set_window_size_limits(window, width, height, glfw.DONT_CARE, glfw.DONT_CARE)
    return window


def _interface_scale(window) -> float:
    """Size of the interface: the monitor's content scale, less what the framebuffer adds itself."""
    content = glfw.get_window_content_scale(window)[0]
    width, framebuffer = glfw.get_window_size(window)[0], glfw.get_framebuffer_size(window)[0]
    return max(content * width / max(framebuffer, 1), 0.5)


def _short_name(renderer: str) -> str:
    """The graphics device without its driver's version string."""
    return renderer.split(" (")[0].split("/")[0].strip()


def _clipboard(window) -> str:
    text = glfw.get_clipboard_string(window)
    return _text(text) if text else ""


def _text(text: bytes | str) -> str:
    return text.decode(errors="replace") if isinstance(text, bytes) else text
