"""Finding photos: folders, the clipboard, the desktop's dialog, and the empty window's commands."""

import os
from pathlib import Path
from typing import Any

import pytest
from PIL import Image, ImageGrab

from app.window.commands import EditDialogPath, ShowDialog, ShowPicture
from app.window.dialogs import Dialog
from app.window.opening import commands as opening
from app.window.opening import effects, native, work
from app.window.opening.panels.welcome import invitation, working
from app.window.opening.pasted import pasted_paths
from app.window.opening.state import MOST_FILES
from app.window.scene import commands as show
from app.window.scene import merging
from app.window.scene.drops import sort_drop
from app.window.state import State
from langflash_core.base.resources import asset_path
from langflash_core.errors import LangFlashError
from tests.app.window.scene.test_rooms import Desk
from tests.app.window.scenes import after, shown_scene


def photo(path: Path, colour=(90, 60, 30)) -> Path:
    Image.new("RGB", (400, 300), colour).save(path)
    return path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("b.jpg", "A.png"):
        photo(tmp_path / name)
    (tmp_path / "inside").mkdir()
    (tmp_path / ".hidden").mkdir()
    (tmp_path / "notes.txt").write_text("no photo")
    (tmp_path / "room.langflash").write_bytes(b"")
    return tmp_path


def opening_desk(clipboard: str = "") -> Desk:
    return Desk(None, lambda hands, world: effects.OpeningEffects(hands, world, lambda: clipboard))


def test_a_folder_shows_folders_photos_and_scenes(folder: Path) -> None:
    found = work.listed(folder)
    assert [path.name for path in found.folders] == ["inside"]
    assert [path.name for path in found.photos] == ["A.png", "b.jpg"]
    assert [path.name for path in found.scenes] == ["room.langflash"]
    assert "cannot be read" in work.listed(folder / "gone").problem


def test_a_large_folder_says_how_much_is_left_out(tmp_path: Path) -> None:
    for place in range(MOST_FILES + 5):
        (tmp_path / f"{place}.jpg").touch()
    found = work.listed(tmp_path)
    assert len(found.photos) == MOST_FILES and found.left_out == 5
    for place in range(MOST_FILES + 3):
        (tmp_path / f"folder {place}").mkdir()
    found = work.listed(tmp_path)
    assert len(found.folders) == MOST_FILES and found.left_out == 5 + 3


def test_small_pictures_come_a_few_at_a_time_and_go_with_the_dialog(folder: Path, monkeypatch) -> None:
    monkeypatch.setattr(native, "is_there", lambda: False)
    for place in range(5):
        photo(folder / f"{place}.jpg")
    (folder / "broken.jpg").write_bytes(b"no photo")
    desk = opening_desk()
    desk.perform(show.AddPhotos((folder / "b.jpg",)))
    desk.perform(opening.OpenFiles())
    assert desk.state.dialog is Dialog.OPEN and desk.state.opening.folder is None
    desk.work()
    assert sum(isinstance(c, ShowPicture) for c in desk.performed) == 7, "the broken one is left out"
    assert sum(isinstance(c, opening.MorePictures) for c in desk.performed) == 2
    desk.perform(opening.Choose(folder / "b.jpg"))
    desk.perform(opening.Choose(folder / "A.png"))
    desk.perform(opening.Choose(folder / "b.jpg"))
    assert desk.state.opening.chosen == (folder / "A.png",)
    desk.perform(ShowDialog(None))
    assert len(desk.world.dropped) == 8


def test_pictures_of_a_folder_that_was_left_are_not_made(folder: Path) -> None:
    desk = opening_desk()
    desk.perform(opening.LookInto(folder))
    desk.work()
    desk.perform(opening.MorePictures(folder / "inside", (folder / "b.jpg",)))
    assert desk.asked == []


def test_paths_are_pasted(folder: Path) -> None:
    left, right = photo(folder / "a b.jpg"), folder / "b.jpg"
    assert pasted_paths(f"'{left}'\n{right}\n") == (str(left), str(right))
    assert pasted_paths(left.as_uri()) == (str(left),)
    assert pasted_paths(f"{left}\nsomething else") == () and effects.pasted_paths("") == ()
    desk = opening_desk(clipboard=str(left))
    desk.perform(opening.Paste())
    assert show.OpenPaths((str(left),)) in desk.performed and not desk.asked


def addresses(folder: Path, count: int) -> list[Path]:
    folder = folder / "photos of a room, from the hall to the window"
    folder.mkdir()
    paths = [folder / f"2024-05-17 at noon, step {number:04d}.jpg" for number in range(count)]
    for path in paths:
        path.touch()
    return paths


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_a_long_list_is_pasted_whole(tmp_path: Path, ends: str) -> None:
    paths = addresses(tmp_path, 300)
    text = ends.join(path.as_uri() for path in paths)
    assert len(text) > 30_000
    assert pasted_paths(text) == tuple(map(str, paths))
    assert pasted_paths(ends.join(map(str, paths)) + ends) == tuple(map(str, paths))


@pytest.mark.parametrize(
    "name",
    ["it's.jpg", "'a'.jpg", "said 'yes'", " blanks ", "a#1?b;c.jpg", "100%25.jpg", "line\u2028end.jpg",
     "\x85.jpg", "ä ö.jpg", "a\\b.jpg", "copy"],
)  # fmt: skip
def test_names_are_pasted_as_they_are(tmp_path: Path, name: str) -> None:
    """Each was cut or changed, beside a file whose name is what was left of it."""
    path, other = tmp_path / name, tmp_path / "other.jpg"
    for each in (path, other, tmp_path / "a"):
        each.touch()
    for first in (
        str(path),
        path.as_uri(),
        f"file:{path.as_uri()[7:]}",
        f"file://localhost{path.as_uri()[7:]}",
    ):
        assert pasted_paths(f"{first}\n{other}") == (str(path), str(other)), first
    assert pasted_paths(f"\"{path}\"\r\n'{other}'") == (str(path), str(other))


def test_a_name_with_a_line_break_or_of_no_text_comes_as_an_address(tmp_path: Path) -> None:
    broken, bytes_of = tmp_path / "a\nb.jpg", Path(os.fsdecode(bytes(tmp_path) + b"/caf\xe9.jpg"))
    for path in (broken, bytes_of):
        assert pasted_paths(path.as_uri()) == (str(path),)
    assert pasted_paths(f"file://{tmp_path}/a#b.jpg") == (f"{tmp_path}/a#b.jpg",), (
        "not every program encodes it"
    )


def test_what_file_managers_put_around_a_list(tmp_path: Path) -> None:
    path = photo(tmp_path / "a b.jpg")
    for heading in ("x-special/nautilus-clipboard\ncopy\n", "cut\n", "# made by hand\r\n"):
        assert pasted_paths(f"{heading}{path.as_uri()}\n") == (str(path),)


def test_what_is_not_there_is_said_and_the_rest_is_taken(tmp_path: Path) -> None:
    """One of many that was moved away meanwhile; the whole list was no list then."""
    here, gone = photo(tmp_path / "a.jpg"), tmp_path / "gone.jpg"
    assert pasted_paths(f"{here}\n{gone.as_uri()}\n{gone}") == (str(here), str(gone), str(gone))
    drop = sort_drop(pasted_paths(f"{here}\n{gone}"))
    assert drop.photos == (here.resolve(),) and drop.rejected == (f"{gone} does not exist; check the path.",)


def test_several_files_are_pasted_into_the_field_for_a_path(tmp_path: Path, monkeypatch) -> None:
    """Its one line makes blanks of the ends of lines."""
    monkeypatch.setattr(native, "is_there", lambda: False)
    paths = addresses(tmp_path, 300)
    desk = opening_desk(clipboard="\r\n".join(path.as_uri() for path in paths))
    desk.perform(opening.OpenFiles())
    desk.perform(EditDialogPath("  ".join(path.as_uri() for path in paths)))
    assert show.OpenPaths(tuple(map(str, paths))) in desk.performed and desk.state.dialog is None
    typed = opening_desk(clipboard=str(paths[0]))
    typed.perform(opening.LookInto(tmp_path))
    typed.perform(EditDialogPath(str(paths[0])))
    assert typed.performed[-1] == EditDialogPath(str(paths[0])), "one path stays in the field"


def test_a_picture_is_pasted_as_a_file_that_stays(folders: Path, monkeypatch) -> None:
    picture: list[Any] = [Image.new("RGBA", (40, 30), (1, 2, 3, 255))]
    monkeypatch.setattr(ImageGrab, "grabclipboard", lambda: picture[0])
    (command,) = work.PastePicture().run(lambda: False)
    assert isinstance(command, show.OpenPaths)
    with Image.open(command.paths[0]) as kept:
        assert kept.size == (40, 30) and Path(command.paths[0]).is_relative_to(folders)
    picture[0] = None
    with pytest.raises(LangFlashError, match="copy a picture"):
        list(work.PastePicture().run(lambda: False))


def test_without_a_clipboard_program_one_sentence_names_one(monkeypatch) -> None:
    def broken():
        raise NotImplementedError("wl-paste or xclip is required")

    monkeypatch.setattr(ImageGrab, "grabclipboard", broken)
    with pytest.raises(LangFlashError, match="xclip"):
        list(work.PastePicture().run(lambda: False))


def test_the_desktops_own_dialog_is_asked_where_there_is_one(monkeypatch) -> None:
    answers: list[Any] = [None, ("/p/a.jpg", "/p/b.jpg")]

    class Dialog:
        def __init__(self, folder: str, scenes_alone: bool) -> None: ...

        def chosen(self):
            return answers.pop(0)

    monkeypatch.setattr(native, "is_there", lambda: True)
    monkeypatch.setattr(native, "NativeDialog", Dialog)
    desk = opening_desk()
    desk.perform(opening.OpenFiles())
    assert desk.state.dialog is None and desk.effects[0].due < 1
    desk.effects[0].tick(desk.state, 1.0)
    desk.effects[0].tick(desk.state, 2.0)
    assert desk.performed[-1] == show.OpenPaths(("/p/a.jpg", "/p/b.jpg"))
    assert desk.effects[0].due == float("inf")
    answers.append(("/p/c.langflash",))
    desk.state = shown_scene()
    desk.perform(opening.OpenFiles(merging=True))
    desk.effects[0].tick(desk.state, 3.0)
    assert desk.performed[-1] == merging.MergeScene(Path("/p/c.langflash"))


def test_photos_stay_on_show_while_they_are_worked_on() -> None:
    tray = after(State(), show.AddPhotos((Path("/p/a.jpg"),)))
    assert not working(tray) and working(after(tray, show.Reconstruct()))
    scene = after(shown_scene(), show.AddPhotos((Path("/p/a.jpg"),)), show.Reconstruct())
    assert not working(scene), "a scene that gains a photo stays on show"
    other = after(
        shown_scene(), show.SetPhotosAside(), show.AddPhotos((Path("/p/a.jpg"),)), show.Reconstruct()
    )
    assert working(other)


def test_the_next_look_begins_where_something_was_opened_or_saved(folder: Path, monkeypatch) -> None:
    """It began at home."""
    monkeypatch.setattr(native, "is_there", lambda: False)
    desk = opening_desk()
    inside = folder / "inside"
    for command, expected in (
        (show.OpenPaths((str(folder / "b.jpg"),)), folder),
        (show.OpenPaths((str(inside),)), inside),
        (show.OpenPaths((str(folder / "gone" / "b.jpg"),)), inside),
        (show.OpenScene(folder / "room.langflash"), folder),
        (merging.MergeScene(inside / "room.langflash"), inside),
        (show.SceneSaved(folder / "room.langflash"), folder),
        (show.OpenPaths((str(asset_path("photos/toy_left.png")),)), folder),
    ):
        desk.perform(command)
        assert desk.state.preferences.folder == str(expected), command
    desk.perform(opening.LookInto(inside))
    desk.work()
    assert desk.state.preferences.folder == str(folder), "a look around is no file opened"
    desk.perform(opening.OpenFiles())
    desk.work()
    assert desk.state.opening.folder is not None and desk.state.opening.folder.path == folder


def test_a_path_that_is_typed_is_listed(folder: Path) -> None:
    """The list below stayed where it was."""
    desk = opening_desk()
    desk.perform(opening.LookInto(folder / "inside"))
    desk.work()
    for text, expected in (
        (str(folder), folder),
        (f"{folder}{os.sep}", folder),
        (f"{folder}{os.sep}in", folder),
        (f"{folder}{os.sep}inside", folder / "inside"),
        (f"{folder}{os.sep}gone{os.sep}x", folder / "inside"),
        ("room", folder / "inside"),
    ):
        desk.perform(EditDialogPath(text))
        desk.work()
        shown = desk.state.opening.folder
        assert shown is not None and shown.path == expected, text
        assert desk.state.typed.text == text
    desk.perform(EditDialogPath(str(folder)))
    desk.work()
    desk.perform(opening.Choose(folder / "b.jpg"))
    assert desk.state.typed.text == "", "what was done last counts"


@pytest.mark.parametrize(("count", "title"), [(0, "Drop photos"), (1, "1 photo waits"), (7, "7 photos wait")])
def test_the_empty_picture_knows_of_photos_that_wait(count: int, title: str) -> None:
    """After a cancelled reconstruction it asked for photos while seven lay beside it."""
    assert invitation(count)[0].startswith(title)
