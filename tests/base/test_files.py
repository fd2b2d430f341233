"""Hidden parts of files: none after a write, and those of killed processes go at the next one; and links."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from langflash_core.base.files import (
    _host,
    check_folder,
    check_output_file,
    filled_atomically,
    held_alone,
    make_folder,
    move_all,
    staged_folder,
    write_atomically,
    written_atomically,
)
from langflash_core.errors import OutputError

# Writes one part of two, says so, and waits for its end.
WRITER = """
import sys, time
from pathlib import Path
from langflash_core.base.files import write_atomically
def parts():
    yield b"half"
    print("half", flush=True)
    time.sleep(600)
write_atomically(Path(sys.argv[1]), parts())
"""


def _parts(folder):
    return sorted(folder.glob(".*.part"))


def _die_while(code: str, folder: Path) -> None:
    """A process that ends in what `code` begins, without leaving it: its part stays in the folder, `here`."""
    begin = (
        "import os, sys; from pathlib import Path; from langflash_core.base import files\n"
        "here = Path(sys.argv[1])\n"
    )
    subprocess.run([sys.executable, "-c", f"{begin}{code}os._exit(0)", str(folder)], check=True)
    assert len(_parts(folder)) == 1


@pytest.fixture
def writer(tmp_path):
    """A process in the middle of writing `tmp_path / "scene"`."""
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, str(tmp_path / "scene")], stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == b"half\n"
        yield process
        process.kill()


def test_the_next_write_sweeps_up_after_a_killed_process(tmp_path, writer):
    assert len(_parts(tmp_path)) == 1
    writer.kill()
    writer.wait()
    write_atomically(tmp_path / "other", b"whole")
    assert _parts(tmp_path) == [] and (tmp_path / "other").read_bytes() == b"whole"
    assert not (tmp_path / "scene").exists()


def test_a_part_that_is_being_written_stays(tmp_path, writer):
    with written_atomically(tmp_path / "other") as place:
        place.write_bytes(b"whole")
    assert len(_parts(tmp_path)) == 1 and writer.poll() is None


def test_only_parts_of_this_computer_and_this_program_are_swept_up(tmp_path):
    foreign = [".scene.0123ab-1-0123456789ab.part", ".scene.0123456789ab.part", "notes.part", ".part"]
    for name in foreign:
        (tmp_path / name).touch()
    write_atomically(tmp_path / "other", b"whole")
    assert sorted(os.listdir(tmp_path)) == sorted([*foreign, "other"])


def test_a_file_name_with_a_line_break_is_swept_up_too(tmp_path):
    _die_while("files.part_beside(here / 'a\\nb').touch()\n", tmp_path)
    write_atomically(tmp_path / "other", b"whole")
    assert _parts(tmp_path) == []


def test_a_folder_takes_the_place_of_another(tmp_path):
    place = tmp_path / "deep" / "room"
    for content in ("first", "second"):
        with filled_atomically(place) as staging:
            assert staging.parent == place.parent and not (staging / content).exists()
            (staging / content).write_text(content)
        assert os.listdir(place) == [content] and os.listdir(place.parent) == ["room"]


def test_a_folder_stays_as_it_was_after_an_error(tmp_path):
    with filled_atomically(tmp_path / "room") as staging:
        (staging / "scene").touch()
    with pytest.raises(ValueError), filled_atomically(tmp_path / "room") as staging:
        (staging / "other").touch()
        raise ValueError
    assert os.listdir(tmp_path) == ["room"] and os.listdir(tmp_path / "room") == ["scene"]


def test_no_folder_where_a_file_is(tmp_path):
    (tmp_path / "room").touch()
    with pytest.raises(OutputError, match="in the way"), filled_atomically(tmp_path / "room"):
        pass
    assert os.listdir(tmp_path) == ["room"]


def test_a_folder_of_a_killed_process_is_swept_up(tmp_path):
    filling = "with files.filled_atomically(here / 'room') as staging:\n    (staging / 'scene').touch()\n    "
    _die_while(filling, tmp_path)
    write_atomically(tmp_path / "other", b"whole")
    assert os.listdir(tmp_path) == ["other"]


def test_a_folder_is_held_by_one(tmp_path):
    place = tmp_path / "deep"
    with held_alone(place):
        with pytest.raises(OutputError, match="another run"), held_alone(place):
            pass
        assert len(_parts(place)) == 1
    with held_alone(place), held_alone(tmp_path):
        pass
    with pytest.raises(FileNotFoundError), held_alone(place):
        (place / "missing").read_bytes()  # of what is done inside, not of the folder
    assert not _parts(place)


def test_a_killed_process_holds_nothing(tmp_path):
    _die_while("with files.held_alone(here):\n    ", tmp_path)
    with held_alone(tmp_path):
        assert len(_parts(tmp_path)) == 1


# --- symbolic links ---------------------------------------------------------------------------------


def _whole(path):
    write_atomically(path, b"new")


def _large(path):
    with written_atomically(path) as place:
        place.write_bytes(b"new")


def _staged(path):
    with staged_folder(path.parent) as staging:
        (staging / path.name).write_bytes(b"new")


WAYS = pytest.mark.parametrize("way", [_whole, _large, _staged])


@WAYS
@pytest.mark.parametrize("there", [True, False])
def test_a_link_stays_and_what_it_leads_to_is_written(tmp_path, way, there):
    """Through a chain of links, a relative one among them; a target that is not there yet is made."""
    target, middle, link = tmp_path / "far" / "b.png", tmp_path / "middle", tmp_path / "a.png"
    target.parent.mkdir()
    if there:
        target.write_bytes(b"old")
    middle.symlink_to("far/b.png")
    link.symlink_to(middle)
    assert check_output_file(link, (".png",)) == link
    way(link)
    assert target.read_bytes() == b"new" and link.is_symlink() and middle.is_symlink()
    assert os.listdir(target.parent) == ["b.png"], "no part is left"
    assert sorted(os.listdir(tmp_path)) == ["a.png", "far", "middle"]


@WAYS
@pytest.mark.parametrize("kind", ["circle", "nowhere", "pipe", "read-only", "read-only itself"])
def test_where_a_link_leads_nowhere_good_it_is_said_and_nothing_is_done(tmp_path, way, kind):
    link, target, said = tmp_path / "a.png", tmp_path / "b", "is read-only; make it writable"
    if kind == "circle":
        target.symlink_to(link)
        said = "lead in a circle"
    elif kind == "nowhere":
        target, said = tmp_path / "gone" / "b", "that folder does not exist; create it"
    elif kind == "pipe":
        os.mkfifo(target)
        said = "is no plain file"
    elif kind == "read-only":
        target.write_bytes(b"old")
        target.chmod(0o444)
    if kind == "read-only itself":
        link.write_bytes(b"old")
        link.chmod(0o444)
    else:
        link.symlink_to(target)
    before = {name: os.lstat(tmp_path / name).st_mode for name in os.listdir(tmp_path)}
    for step in (check_output_file, way):
        with pytest.raises(OutputError) as refused:
            step(link)
        assert said in str(refused.value) and "a.png" in str(refused.value)
    assert {name: os.lstat(tmp_path / name).st_mode for name in os.listdir(tmp_path)} == before
    assert "read-only" not in kind or link.read_bytes() == b"old"


def test_all_or_none_also_where_one_of_several_is_read_only(tmp_path):
    (tmp_path / "b").write_bytes(b"old")
    (tmp_path / "b").chmod(0o444)
    with pytest.raises(OutputError, match="read-only"), staged_folder(tmp_path) as staging:
        (staging / "a").write_bytes(b"new")
        (staging / "b").write_bytes(b"new")
    assert os.listdir(tmp_path) == ["b"] and (tmp_path / "b").read_bytes() == b"old"


@pytest.mark.parametrize("there", [True, False])
def test_a_link_to_a_folder_stays(tmp_path, there):
    link, target = tmp_path / "out", tmp_path / "far"
    if there:
        target.mkdir()
    link.symlink_to(target)
    check_folder(link)
    with staged_folder(link / "deep") as staging:
        (staging / "a").write_bytes(b"new")
    assert link.is_symlink() and (target / "deep" / "a").read_bytes() == b"new"
    with filled_atomically(link) as staging:
        (staging / "b").write_bytes(b"new")
    assert link.is_symlink() and os.listdir(target) == ["b"]
    assert sorted(os.listdir(tmp_path)) == ["far", "out"]
    make_folder(link)


def test_a_link_onto_another_disk(tmp_path, monkeypatch):
    """Files cannot be moved there, only copied."""
    target, link = tmp_path / "far" / "b", tmp_path / "a"
    target.parent.mkdir()
    target.write_bytes(b"old")
    link.symlink_to(target)
    replace = os.replace

    def moved(source, place):
        if source.parent != place.parent:
            raise OSError(errno.EXDEV, os.strerror(errno.EXDEV), str(source))
        replace(source, place)

    monkeypatch.setattr(os, "replace", moved)
    _staged(link)
    assert target.read_bytes() == b"new" and link.is_symlink() and os.listdir(target.parent) == ["b"]


# --- several files at once --------------------------------------------------------------------------


def test_folder_is_made_only_at_the_end(tmp_path):
    target = tmp_path / "a" / "b"
    with staged_folder(target) as staging:
        (staging / "x.txt").write_bytes(b"x")
        (staging / "y.txt").write_bytes(b"y")
        assert not (tmp_path / "a").exists()
    assert sorted(os.listdir(target)) == ["x.txt", "y.txt"]
    assert os.listdir(tmp_path) == ["a"]  # no staging folder is left


def test_files_beside_are_kept_and_old_ones_replaced(tmp_path):
    (tmp_path / "mine.txt").write_bytes(b"mine")
    (tmp_path / "x.txt").write_bytes(b"a long old content")
    with staged_folder(tmp_path) as staging:
        (staging / "x.txt").write_bytes(b"new")
    assert (tmp_path / "x.txt").read_bytes() == b"new"
    assert sorted(os.listdir(tmp_path)) == ["mine.txt", "x.txt"]


def test_what_is_staged_for_the_folder_one_is_in_lies_in_it(tmp_path, monkeypatch):
    """Its parent may belong to somebody else."""
    own = tmp_path / "own"
    own.mkdir()
    monkeypatch.chdir(own)
    with staged_folder(Path("x.txt").parent) as staging:
        assert staging.resolve().parent == own
        (staging / "x.txt").write_bytes(b"x")
    assert os.listdir(own) == ["x.txt"]


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ValueError])
def test_interruption_leaves_nothing(tmp_path, stop):
    with pytest.raises(stop), staged_folder(tmp_path / "new" / "folder") as staging:
        (staging / "x.txt").write_bytes(b"x")
        raise stop
    assert os.listdir(tmp_path) == []


def test_all_or_nothing_when_a_target_is_a_folder(tmp_path):
    (tmp_path / "b.png").mkdir()
    with pytest.raises(OutputError, match=r"b\.png"), staged_folder(tmp_path) as staging:
        (staging / "a.png").write_bytes(b"a")
        (staging / "b.png").write_bytes(b"b")
    assert os.listdir(tmp_path) == ["b.png"]


def test_failed_move_is_undone(tmp_path):
    """The second file is gone: the first one's move and its new folders are taken back."""
    (tmp_path / "a").write_bytes(b"a")
    target = tmp_path / "new" / "folder"
    with pytest.raises(OutputError, match="choose another -o"):
        move_all({tmp_path / "a": target / "a", tmp_path / "gone": target / "gone"})
    assert not (tmp_path / "new").exists()


def test_check_leaves_no_trace(tmp_path):
    check_folder(tmp_path / "not" / "there" / "yet")
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write everywhere")
def test_read_only_folder(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="cannot write"):
        check_folder(tmp_path)


def test_output_file(tmp_path):
    assert check_output_file(tmp_path / "new" / "A.PNG", (".png",)) == tmp_path / "new" / "A.PNG"
    with pytest.raises(OutputError, match=r"\.png"):
        check_output_file(tmp_path / "a.jpg", (".png",))
    with pytest.raises(OutputError, match="rename --sheet"):
        check_output_file(tmp_path / "a.jpg", (".png",), option="--sheet")
    with pytest.raises(OutputError, match="folder"):
        check_output_file(tmp_path)
    photo = tmp_path / "a.jpg"
    photo.write_bytes(b"")
    with pytest.raises(OutputError, match="also an input"):
        check_output_file(tmp_path / "." / "a.jpg", inputs=[Path("elsewhere"), photo])
    with pytest.raises(OutputError, match="not a folder; choose another --sheet"):
        check_output_file(photo / "a.jpg", option="--sheet")
    assert os.listdir(tmp_path) == ["a.jpg"]


def test_what_a_killed_process_left_beside_a_new_folder_is_swept_up(tmp_path):
    """It lay beside the folder, which was not there yet; the next export writes into the folder."""
    gone = f".export.{_host()}-{2**22 + 7}-0123456789ab.part"  # no process has such a number
    (tmp_path / gone).mkdir()
    (tmp_path / gone / "half").write_bytes(b"x")
    (tmp_path / "out").mkdir()
    with staged_folder(tmp_path / "out") as staging:
        (staging / "a").write_bytes(b"whole")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
