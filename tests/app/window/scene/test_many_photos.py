"""Scenes of hundreds of photos: small pictures of all, the one that is compared whole; progress photo by
photo."""

import io
from dataclasses import replace

import numpy as np
from PIL import Image

from app.window.commands import ShowPicture
from app.window.scene.commands import Progressed
from app.window.scene.panels import tray
from app.window.scene.state import Job, head_of, said
from app.window.scene.work import THUMBNAIL_SIDE, ShrinkPhotos
from app.window.state import State


def jpeg(side: int) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(np.full((side, side, 3), 90, np.uint8)).save(stream, "JPEG")
    return stream.getvalue()


def test_many_photos_are_shown_small_and_a_damaged_one_by_its_number() -> None:
    shown = list(ShrinkPhotos(7, (jpeg(768), b"no picture", jpeg(30))).run(lambda: False))
    assert [command.key for command in shown if isinstance(command, ShowPicture)] == ["view 0", "view 2"]
    sizes = [command.rgb.shape for command in shown if isinstance(command, ShowPicture)]
    assert sizes == [(THUMBNAIL_SIDE, THUMBNAIL_SIDE, 3), (30, 30, 3)]


def test_a_stage_is_one_whatever_photo_it_is_at() -> None:
    state = replace(State().with_scene(job=Job("Reconstructing")), now=10.0)
    state = Progressed("refinement: photo 1 of 3", 0.5).apply(state)
    assert state.scene.job is not None and state.scene.job.started == 10.0
    state = Progressed("refinement: photo 2 of 3", 0.6).apply(replace(state, now=14.0))
    assert (
        state.scene.job is not None
        and state.scene.job.stage.endswith("2 of 3")
        and state.scene.job.started == 10.0
    )
    state = Progressed("light", 0.7).apply(replace(state, now=16.0))
    assert state.scene.job is not None and state.scene.job.done[-1] == ("refinement", 6.0)
    assert head_of("refinement: photo 1 of 3") == "refinement" == head_of("refinement")
    assert said("refinement: photo 1 of 3").endswith(": photo 1 of 3") != said("refinement")


def test_what_is_left_of_a_job_is_told() -> None:
    job = Job("Reconstructing", "refinement: photo 3 of 9", 0.5, started=20.0, done=(("photos", 10.0),))
    assert tray._seconds(job, 30.0) == "about 20 s left"
    assert tray._seconds(replace(job, fraction=0.01), 30.0) == "10.0 s"
