"""Pictures at rest where OpenGL runs on the processor: ordered of a thread, in half the size first, each with
its answers, and shown once they tell what is asked."""

import math
import os
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import torch

from langflash_core.geometry.nearness import NEAREST
from langflash_core.geometry.poses import to_camera
from langflash_core.scene.exposure import lit_camera

from ...gl.layered import MOVING
from ...gl.processor.artist import Artist, Stopping, Work
from ...gl.processor.still import Still, draw_still
from ..governor import Kind
from ..state import State
from .easel import Easel
from .values import Drawn, Numbers

if TYPE_CHECKING:
    from langflash_core.language.relevance import CompiledQuery
    from langflash_core.types import Scene

SCALES = (0.5, 1.0)
"""Of the still pictures that follow each other. Of a scene of layers the smaller ones have as few as what
moved, and come twice as soon."""
MOST_THREADS = 8  # of one
RETRY_SECONDS = 5.0  # until one that could not be drawn is tried again


class Stills:
    """Those of one scene. shown: the one on the easel; None where the renderer drew what is there."""

    def __init__(self, easel: Easel, scene: "Scene", notify: Callable[[], None]) -> None:
        self.shown: Still | None = None
        self._easel = easel
        self._scene = scene
        self._artist = Artist(notify)
        self._finished: tuple[Drawn, Still, float] | None = None  # to be shown; seconds that it took
        self._failed: tuple[object, float] | None = None  # the order that came to nothing, and when

    @property
    def busy(self) -> bool:
        """Whether one is being drawn, or its answers made."""
        return self._artist.busy

    def drop(self) -> None:
        """Nothing is wanted while something moves."""
        self._artist.drop()

    def stop(self, patience: float) -> None:
        """End the thread, and wait so many seconds for it."""
        self._artist.stop(patience)

    @property
    def failing(self) -> bool:
        """Whether the last order came to nothing."""
        return self._failed is not None

    def retry(self, now: float) -> float:
        """Seconds until what came to nothing is tried again; infinity where nothing did."""
        return math.inf if self._failed is None else max(self._failed[1] + RETRY_SECONDS - now, 0.0)

    # --- what comes of the thread -----------------------------------------------------------

    def collect(self, moved: float, now: float) -> None:
        """Take what is done. A failure from before the last movement counts no more."""
        if self._failed is not None and self._failed[1] < moved:
            self._failed = None
        done = self._artist.take()
        if done is None:
            return
        name, result = done
        self._failed = (name, now) if result is None else None
        if result is not None and isinstance(name, Drawn):
            self._finished = name, *result

    def show(self, wanted: Drawn, state: State) -> None:
        """Put the picture that is finished on the easel, once it tells all that is asked of it."""
        if self._finished is None:
            return
        name, still, seconds = self._finished
        if replace(name, plan=wanted.plan) != wanted:
            self._finished = None  # of what is no longer on show
        elif self._tells(still, state):
            self._finished = None
            self._easel.bring(still, name, seconds)
            self.shown = still

    def ready(self, state: State) -> bool:
        """Whether what is on show needs no long work for what is asked."""
        return self.shown is None or self._tells(self.shown, state)

    def numbers(self, state: State) -> Numbers | None:
        """Of what is on show; None while they are not there."""
        query = self._easel.asked.query
        if not self.ready(state) or query is None:
            return None
        if self.shown is None or self.shown.maps is None:
            return self._easel.numbers()
        maps = self.shown.maps
        others = None if query.others is None else torch.from_numpy(maps.relevance(query.others))
        return Numbers(self.shown.frame, torch.from_numpy(maps.relevance(query)), others)

    # --- what is ordered --------------------------------------------------------------------

    def order(self, wanted: Drawn, kind: Kind, state: State) -> None:
        """The next still picture, or what the one on show does not tell yet. A moving one is none, however
        large it is: it ends footprints early."""
        finer = (scale for scale in SCALES if scale >= wanted.plan.scale)  # a coarser one would be drawn over
        names = (wanted.at(kind, scale) for scale in finer)
        moving = self.shown is None
        name = next((name for name in names if moving or not self._easel.covers(name)), None)
        if name is not None and self._finished is None:
            if not self._waits(name, state.now):
                self._artist.order(name, self._drawing(name, state))
            return
        still = self.shown if self._finished is None else self._finished[1]
        if still is None or self._tells(still, state):
            self._failed = None  # there is all that is wanted
            return
        answers = (still.key, self._easel.asked.number, state.scene.mode)
        if not self._waits(answers, state.now):
            ask = self._questions(state)
            self._artist.order(answers, lambda stopping: ask(still) or True)

    def _waits(self, name: object, now: float) -> bool:
        """Whether an order came to nothing a moment ago, in whatever plan, and is not tried again yet."""
        if self._failed is None or self.retry(now) == 0:
            return False
        failed = self._failed[0]
        if isinstance(name, Drawn) and isinstance(failed, Drawn):
            return name == replace(failed, plan=name.plan)
        return name == failed

    def _drawing(self, name: Drawn, state: State) -> Work:
        """The work of a picture so named, for the thread; it gives the picture and seconds that it took."""
        width, height = (max(8, round(side * name.plan.scale)) for side in name.size)
        marked, scene = self._easel.marked, self._scene
        camera = lit_camera(scene, to_camera(name.pose, width, height))
        ask, maps = self._questions(state), name.plan.kind is Kind.MAPS

        def work(stopping: Stopping) -> tuple[Still, float]:
            start = time.perf_counter()
            drawn = draw_still(
                scene if marked is None else marked.edited,
                camera,
                marks=None if marked is None else marked.shown,
                weight_maps=maps,
                most=NEAREST if name.plan.scale == 1 else MOVING,
                threads=min(os.cpu_count() or 1, MOST_THREADS),
                stopping=stopping,
            )
            ask(drawn)
            return drawn, time.perf_counter() - start

        return work

    def _questions(self, state: State) -> Callable[[Still], None]:
        """What is to be made of a still picture on the thread, so that showing it is quick."""
        query, columns = self._easel.asked.query, None
        if state.scene.mode.columns:
            columns = self._easel.renderer.columns(state.scene.mode.columns == "features")

        def ask(still: Still) -> None:
            if still.maps is not None:
                for asked in _both(query):
                    still.maps.relevance(asked)
                if columns is not None:
                    still.maps.mixed(columns)
            _ = still.frame

        return ask

    def _tells(self, still: Still, state: State) -> bool:
        """Whether showing a still picture in the present mode needs no long work."""
        query = self._easel.asked.query
        if still.maps is None:
            return True
        if not all(still.maps.answers(asked) for asked in _both(query)):
            return False
        if not state.scene.mode.columns:
            return True
        return still.maps.mixes(self._easel.renderer.columns(state.scene.mode.columns == "features"))


def _both(query: "CompiledQuery | None") -> "list[CompiledQuery]":
    """A question, and that of the things that its phrases relate their heads to."""
    return [each for each in (query, query and query.others) if each is not None]
