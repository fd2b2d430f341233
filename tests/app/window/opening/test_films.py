"""A film in the window: looked through, its strip shown and changed, its frames made a scene."""

from dataclasses import replace
from pathlib import Path

import pytest

from app.window.commands import ShowDialog, ShowPicture
from app.window.dialogs import Dialog
from app.window.frame import table
from app.window.opening import commands as opening
from app.window.opening import work
from app.window.opening.effects import OpeningEffects
from app.window.opening.panels import strip as panel
from app.window.opening.state import Film, told_film
from app.window.scene import commands as show
from app.window.scene.drops import sort_drop
from app.window.scene.work import ReconstructPhotos
from app.window.state import State
from langflash_core.errors import Cancelled, FilmError
from langflash_core.images.settings import PHOTO_LIMITS
from tests import films
from tests.app.window.scene import test_rooms
from tests.app.window.scenes import shown_scene


@pytest.fixture(autouse=True)
def home(monkeypatch, tmp_path_factory) -> None:
    monkeypatch.setenv("LANGFLASH_HOME", str(tmp_path_factory.getbasetemp() / "films home"))


@pytest.fixture(scope="module")
def walk(tmp_path_factory) -> Path:
    return films.write(tmp_path_factory.mktemp("film") / "walk.mp4", films.walk(40, 10.0))


class Desk(test_rooms.Desk):
    """Scene and opening."""

    def __init__(self, state: State | None = None) -> None:
        opens = lambda hands, world: OpeningEffects(hands, world, lambda: "")  # noqa: E731
        super().__init__(state, test_rooms.of_scene, opens)

    def look_through(self) -> None:
        """What the worker does with the film, and with its small pictures."""
        job = self.asked.pop(0)
        assert isinstance(job, work.LookThrough)
        self.perform(
            job.run(1, lambda stage, share: self.perform(show.Progressed(stage, share)), lambda: False)
        )
        while self.asked and isinstance(self.asked[0], work.SmallPictures):
            self.perform(*self.asked.pop(0).run(lambda: False))

    @property
    def film(self) -> Film:
        assert self.state.opening.film is not None
        return self.state.opening.film


@pytest.fixture
def desk(walk: Path) -> Desk:
    made = Desk()
    made.perform(show.OpenPaths((str(walk),), dropped=True))
    assert made.state.scene.job is not None and made.state.scene.job.title == "Opening walk.mp4"
    made.look_through()
    return made


def test_a_dropped_film_shows_its_strip(desk: Desk, walk: Path) -> None:
    assert desk.state.dialog is Dialog.FILM and desk.state.scene.job is None and desk.film.path == walk
    assert 10 < len(desk.film.chosen) <= PHOTO_LIMITS.film_photos and desk.state.scene.photos == ()
    pictures = [command for command in desk.performed if isinstance(command, ShowPicture)]
    assert len(pictures) == len(desk.film.strip.stills)
    told = panel.told(desk.film)
    assert told.startswith("Of 40 frames, ") and "lay between the chosen ones" in told
    desk.perform(ShowDialog(None))
    assert len(desk.world.dropped) == len(pictures), "small pictures go with the dialog"
    entry = next(each for each in table.ENTRIES if each.name.startswith("Frames of the film"))
    again = entry.make(desk.state)
    assert again == ShowDialog(Dialog.FILM) and entry.make(State()) is None
    assert again is not None
    desk.perform(again)
    assert isinstance(desk.asked[-1], work.SmallPictures)


def test_frames_are_put_in_and_taken_out(desk: Desk) -> None:
    first, *others = desk.film.chosen
    desk.perform(opening.SwitchFrame(first))
    assert desk.film.chosen == tuple(others)
    desk.perform(opening.SwitchFrame(first))
    assert desk.film.chosen == (first, *others)
    desk.perform(opening.SwitchFrame(999))
    desk.perform(opening.ProposeFrames(5, exactly=True))
    assert len(desk.film.chosen) == 5
    desk.perform(opening.ProposeFrames(6, exactly=True))
    assert len(desk.film.chosen) == 6
    desk.perform(opening.ProposeFrames(PHOTO_LIMITS.film_photos))
    assert desk.film.chosen == (first, *others)
    assert not desk.asked, "nothing is decoded or read for that"


def test_the_chosen_frames_become_a_scene(desk: Desk) -> None:
    desk.perform(opening.ProposeFrames(4, exactly=True))
    desk.perform(opening.TakeFrames())
    assert desk.state.dialog is None and desk.state.scene.job is not None
    assert tuple(photo.path for photo in desk.state.scene.photos) == desk.film.frames
    job = next(each for each in desk.asked if isinstance(each, ReconstructPhotos))
    assert job.paths == desk.film.frames and len(job.paths) == 4
    desk.perform(opening.ProposeFrames(3, exactly=True))
    desk.perform(opening.TakeFrames())
    assert len(desk.state.scene.photos) == 3, "frames of the same film that were in the tray before are not"


def test_beside_photos_and_beside_a_scene(walk: Path, tmp_path: Path) -> None:
    photos = tuple(tmp_path / f"{number}.jpg" for number in range(PHOTO_LIMITS.max_photos - 3))
    desk = Desk()
    desk.perform(show.AddPhotos(photos))
    desk.asked.clear()
    desk.perform(show.OpenPaths((str(walk),)))
    desk.look_through()
    assert len(desk.film.chosen) == 3
    left = next(index for index in range(40) if index not in desk.film.chosen)
    desk.perform(opening.SwitchFrame(left))
    assert len(desk.film.chosen) == 3 and "At most 3 frames" in desk.state.toasts[-1].text
    desk.perform(opening.TakeFrames())
    assert (
        len(desk.state.scene.photos) == PHOTO_LIMITS.max_photos
        and desk.state.scene.photos[0].path == photos[0]
    )

    desk = Desk(shown_scene())
    desk.perform(show.OpenPaths((str(walk),), dropped=True))
    desk.look_through()
    desk.perform(opening.TakeFrames())
    assert desk.state.scene.aside is not None, "the scene's own photos come back if this fails"
    assert tuple(photo.path for photo in desk.state.scene.photos) == desk.film.frames


def test_what_cannot_be_used_is_said(tmp_path: Path, walk: Path) -> None:
    broken = tmp_path / "broken.mp4"
    broken.write_bytes(b"no film")
    with pytest.raises(FilmError):
        work.LookThrough(broken).run(1, lambda stage, share: None, lambda: False)
    with pytest.raises(Cancelled):
        path = films.write(tmp_path / "other.mp4", films.walk(20))
        work.LookThrough(path).run(1, lambda stage, share: None, lambda: True)
    desk = Desk()
    still = films.write(tmp_path / "still.mp4", [films.seen(0)] * 10)
    desk.perform(show.OpenPaths((str(still), str(walk))))
    assert "one film at a time" in desk.state.toasts[-1].text
    desk.look_through()
    assert (
        desk.state.dialog is None
        and desk.state.scene.job is None
        and "stands still" in desk.state.toasts[-1].text
    )


def test_a_scene_that_is_not_opened_is_said(tmp_path: Path, walk: Path) -> None:
    """Scenes after the first, and one that comes with photos or a film, were passed over."""
    scenes, photo = [tmp_path / "a.ply", tmp_path / "b.langflash"], tmp_path / "c.jpg"
    for path in (*scenes, photo):
        path.touch()
    for given, said in (
        (scenes, "Only a.ply was opened"),
        ([scenes[1], photo], "b.langflash was not opened, since photos came with it"),
        ([scenes[1], walk], "b.langflash was not opened, since a film came with it"),
    ):
        desk = Desk()
        desk.perform(show.OpenPaths(tuple(map(str, given))))
        assert said in desk.state.toasts[-1].text
    desk = Desk()
    desk.perform(show.OpenPaths((str(scenes[0]),)))
    assert not desk.state.toasts


def test_one_scene_at_a_time_is_chosen_to_be_merged(tmp_path: Path) -> None:
    desk = Desk(shown_scene())
    desk.perform(opening.LookInto(tmp_path, dialog=Dialog.MERGE))
    for name in ("a.ply", "b.ply"):
        desk.perform(opening.Choose(tmp_path / name))
    assert desk.state.opening.chosen == (tmp_path / "b.ply",)


def test_films_are_found(tmp_path: Path, walk: Path) -> None:
    (tmp_path / "a.MOV").touch()
    assert sort_drop([tmp_path]).films == ((tmp_path / "a.MOV").resolve(),)
    (tmp_path / "a.jpg").touch()
    assert sort_drop([tmp_path]).films == () and len(sort_drop([tmp_path]).photos) == 1
    assert [path.name for path in work.listed(tmp_path).films] == ["a.MOV"]


def test_what_is_told_of_frames_adds_up_however_they_are_chosen(desk: Desk) -> None:
    """A frame that was taken in by hand was still among those left out."""

    def kept() -> int:
        return len(desk.film.chosen) + sum(desk.film.left_out.values())

    assert kept() == desk.film.strip.num_looked_at == 40
    proposed = desk.film.left_out
    left = next(index for index in range(len(desk.film.strip.stills)) if index not in desk.film.chosen)
    desk.perform(opening.SwitchFrame(left))
    assert kept() == 40 and sum(told_film(desk.film)["why"].values()) == 40 - len(desk.film.chosen)
    assert f"{proposed['between'] - 1} lay between the chosen ones" in panel.told(desk.film)
    for index in range(len(desk.film.strip.stills)):
        desk.perform(opening.SwitchFrame(index))
        assert kept() == 40 and min(desk.film.left_out.values()) >= 0
    for index in {*desk.film.chosen} ^ {*desk.film.proposed}:
        desk.perform(opening.SwitchFrame(index))
    assert desk.film.left_out == proposed


def test_a_blurred_frame_that_is_taken_in_was_blurred(desk: Desk) -> None:
    stills = tuple(
        replace(still, blurred=1, smear=2.0) if index == 3 else still
        for index, still in enumerate(desk.film.strip.stills)
    )
    strip = replace(desk.film.strip, stills=stills)
    film = opening.proposed(desk.film.path, strip, PHOTO_LIMITS.film_photos)
    assert 3 not in film.chosen
    by_hand = replace(film, chosen=tuple(sorted({*film.chosen, 3})))
    assert by_hand.left_out["blurred"] == film.left_out["blurred"] - 1
    assert sum(by_hand.left_out.values()) + len(by_hand.chosen) == strip.num_looked_at
