"""The one worker thread: everything slow or heavy, and neither OpenGL nor ImGui.

A *job* makes a scene; the newest replaces and cancels the one before, which then falls silent.
*Tasks* are short and run between jobs and, so that typing works during a reconstruction,
between the stages of one. What comes of either are commands.
"""

import ctypes
import gc
import logging
import os
import sys
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from queue import Empty, SimpleQueue

from PIL import Image

from langflash_core.base.memory import give_back, out_of_memory
from langflash_core.errors import Cancelled, LangFlashError

from .commands import Command, Notify, OfScene
from .requests import Job, SceneTask, Task
from .scene.commands import JobCancelled, JobFailed, Loaded, Progressed

log = logging.getLogger(__name__)

AHEAD = ("langflash_core.pipeline", "langflash_core.reconstruction.stages", "scipy.spatial.transform")
"""What the first reconstruction and the first turn of a thing import, in this order."""
IDLE = 0.5  # seconds without a request until the next of them is imported
SAVING_SECONDS = 60.0  # that `stop` waits at the most for what a person asked to be saved


class Worker:
    """A thread with a mailbox. `notify` is called, from the thread, after each command.

    `submit` and `cancel` return at once. `stop` cancels, waits at most `patience` seconds, and
    may be called twice. Unless `begins`, what is asked of it waits for `begin`.
    """

    def __init__(self, notify: Callable[[], None] = lambda: None, begins: bool = True) -> None:
        self._notify = notify
        self._changed = threading.Condition()
        self._tasks: list[Task] = []
        self._task: Task | None = None  # under way
        self._job: Job | None = None
        self._token = 0  # of the newest job; an older one is silent
        self._busy = False  # with a job that speaks
        self._stopping = False
        self._results: SimpleQueue[Command] = SimpleQueue()
        self._serial = 0
        self._thread = threading.Thread(target=self._run, name="langflash-worker", daemon=True)
        if begins:
            self.begin()

    def begin(self) -> None:
        """Start the thread, once; it takes seconds to load what it needs."""
        if self._thread.ident is None:
            self._thread.start()

    def submit(self, request: Job | Task) -> None:
        """Queue a request; a job cancels the job under way."""
        with self._changed:
            if isinstance(request, Job):
                self._job = request
                self._token += 1
            else:
                kept = self._tasks
                if request.newest_counts:
                    kept = [e for e in kept if type(e) is not type(request)]
                self._tasks = [*kept, request]
            self._changed.notify()

    def cancel(self) -> None:
        """Stop the job; `JobCancelled` comes at once, and the job ends within a layer of the network."""
        with self._changed:
            busy = self._busy or self._job is not None
            self._token += 1  # from here on the job is silent
            self._job, self._busy = None, False
        if busy:
            self._put(JobCancelled())

    def poll(self) -> list[Command]:
        """Commands that have come since the last call, oldest first."""
        came: list[Command] = []
        while True:
            try:
                came.append(self._results.get_nowait())
            except Empty:
                return came

    def stop(self, patience: float = 2.0) -> None:
        """End the thread, after what it was told to save. A stage that takes longer than `patience`
        dies with the process."""
        with self._changed:
            self._stopping = True
            self._tasks = [task for task in self._tasks if task.saves]
            if self._tasks or (self._task is not None and self._task.saves):
                patience = SAVING_SECONDS
                self.begin()
            self._changed.notify()
        if self._thread.ident is not None:
            self._thread.join(patience)

    def _put(self, *commands: Command) -> None:
        for command in commands:
            self._results.put(command)
            self._notify()

    def _run(self) -> None:
        try:
            for load in (_link_torch, _import_heavy):
                self._run_tasks(light=True)
                load()
            self._put(Loaded())
        except Exception as error:  # a broken installation: say so, and let each request say it again
            self._put(Notify(_unexpected(error)))
        foresight = list(AHEAD)
        while True:
            with self._changed:
                self._changed.wait_for(self._asked, IDLE if foresight else None)
                if self._stopping and not self._tasks:
                    return
                job, token = self._job, self._token
                if not self._tasks:
                    self._job, self._busy = None, job is not None
            if self._tasks:
                self._run_tasks()
            elif job is not None:
                self._run_job(job, token)
            elif foresight:
                _import_ahead(foresight.pop(0))

    def _asked(self) -> bool:
        return bool(self._stopping or self._tasks or self._job)

    def _run_tasks(self, light: bool = False) -> None:
        """Run what is queued now, oldest first. light: only what needs nothing loaded."""
        while True:
            with self._changed:
                ready = [each for each in self._tasks if each.light or not light]
                task = next((each for each in ready if each.urgent), ready[0] if ready else None)
                self._task = task
                if task is None:
                    return
                self._tasks.remove(task)
            try:
                for command in task.run(lambda: self._stopping):
                    about = isinstance(task, SceneTask)
                    self._put(OfScene(task.serial, command) if about else command)
            except LangFlashError as error:
                self._put(*task.failed(str(error)))
            except Exception as error:
                self._put(*task.failed(_unexpected(error)))

    def _run_job(self, job: Job, token: int) -> None:
        def stale() -> bool:
            return self._token != token

        def cancelled() -> bool:
            return self._stopping or stale()

        def progress(stage: str, fraction: float) -> None:
            if not stale():
                self._put(Progressed(stage, fraction))
            with _outside_inference():
                self._run_tasks()

        self._serial += 1
        try:
            outcome: Command | None = job.run(self._serial, progress, cancelled)
        except Cancelled:
            outcome = None  # whoever stopped it has been told
        except LangFlashError as error:
            outcome = JobFailed(str(error))
        except Exception as error:
            outcome = JobFailed(_unexpected(error))
        with self._changed:
            spoken = outcome is not None and not stale()
            self._busy = self._busy and stale()
        if spoken and outcome is not None:
            self._put(outcome)
        give_back()


def _outside_inference() -> AbstractContextManager[None]:
    """A network tells of its progress in the mode in which it predicts; tensors that are made there can never
    be changed outside of it, and those of tasks are kept and changed."""
    torch = sys.modules.get("torch")
    return nullcontext() if torch is None else torch.inference_mode(False)


def _import_heavy() -> None:
    """Load torch and the renderer's module here, while the window is already up."""
    import torch  # noqa: F401

    from .. import gl

    Image.preinit()  # else the first thumbnail of the window does
    gc.freeze()
    log.debug("loaded %s", gl.__name__)


def _link_torch() -> None:
    """Link torch's largest library through a foreign call, which lets go of the interpreter.

    `import torch` would hold on to it for about half a second, and so hold up a frame.
    """
    spec = find_spec("torch")
    if sys.platform != "linux" or spec is None or spec.origin is None:
        return
    library = Path(spec.origin).parent / "lib" / "libtorch_cpu.so"
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).dlopen(os.fsencode(library), os.RTLD_NOW)  # 0 where it fails: torch will say why


def _import_ahead(name: str) -> None:
    """Import what would be waited for later, while nobody waits."""
    try:
        import_module(name)
    except Exception:  # who needs it will say so
        log.debug("%s cannot be imported", name, exc_info=True)
    # What modules hold stays for good. The collector, which stops every thread, need not look at it
    # again: that took a fifth of a second each time.
    gc.freeze()


def _unexpected(error: Exception) -> str:
    if out_of_memory(error):
        return "There was not enough memory; close other programs, or use fewer or smaller photos."
    log.exception("the worker met an unexpected error")
    return f"Something unexpected went wrong ({type(error).__name__}: {error}); please report it."
