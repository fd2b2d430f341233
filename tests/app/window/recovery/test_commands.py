"""Preferences and offers: what their commands do, without a window."""

from dataclasses import replace
from datetime import datetime
from pathlib import Path

from app.window.asking import commands as ask
from app.window.recovery import commands as keep
from app.window.recovery.preferences import PANEL_WIDTHS
from app.window.recovery.state import Kept, Offer
from app.window.scene import commands as show
from app.window.state import State
from langflash_core.base import pictures
from langflash_core.geometry.poses import Pose, Vector
from tests.app.window.scenes import after
from tests.app.window.scenes import shown_scene as scene


def test_the_layout_is_kept_within_its_limits() -> None:
    wanted = replace(State().preferences, panel_width=9999.0, dictionary=(1, 2, 380, 300))
    state = after(State(), keep.Prefer(wanted), ask.OpenDictionary(True))
    kept = state.preferences
    assert (kept.panel_width, kept.dictionary, kept.dictionary_open) == (
        PANEL_WIDTHS[1],
        (1, 2, 380, 300),
        True,
    )


def test_recent_files_begin_with_the_newest() -> None:
    state = after(State(), keep.Opened(Path("/a")), keep.Opened(Path("/b")), keep.Opened(Path("/a")))
    assert state.preferences.recent == ("/a", "/b")
    assert after(state, keep.ForgetRecent()).preferences.recent == ()


def test_a_restored_session_has_its_photos_phrases_camera_and_mode() -> None:
    pose = Pose(Vector(0.0, 0.5, 0.0))
    kept = Kept(photos=("/p/a.jpg",), fovs=(60.0,), phrases=("door", "rug"), mode="DEPTH", pose=pose)
    state = after(State(), keep.OfferSession(kept), keep.EndSessionOffer(restore=True))
    assert [photo.fov for photo in state.scene.photos] == [60.0] and state.recovery.session is None
    assert [prompt.text for prompt in state.asking.prompts] == ["door", "rug"]
    again = keep.StandAgain(replace(kept, name="kitchen", saved=False))
    assert after(state, again) == state  # no scene yet
    info = scene().scene.info
    assert info is not None
    shown = after(state, show.SceneArrived(info), again)
    assert shown.scene.mode is pictures.DEPTH and shown.scene.pose == pose and shown.scene.view is None
    assert shown.scene.info is not None and (shown.scene.info.name, shown.scene.info.path) == (
        "kitchen",
        None,
    )
    turned_down = after(State(), keep.OfferSession(kept), keep.EndSessionOffer(restore=False))
    assert turned_down == State()


def test_offers_end(shown: State) -> None:
    offer = Offer(Path("x.edits"), "room", 3, datetime(2026, 1, 2))
    state = after(shown, keep.OfferEdits(offer))
    assert state.recovery.edits == offer and after(state, keep.EndOffer()).recovery.edits is None
