"""Hidden parts of files: none after a write, and those of killed processes go at the next one."""

import os
import subprocess
import sys

import pytest

from langflash_core.errors import OutputError
from langflash_core.files import filled_atomically, held_alone, write_atomically, written_atomically

# Writes one part of two, says so, and waits for its end.
WRITER = """
import sys, time
from pathlib import Path
from langflash_core.files import write_atomically
def parts():
    yield b"half"
    print("half", flush=True)
    time.sleep(600)
write_atomically(Path(sys.argv[1]), parts())
"""


def _parts(folder):
    return sorted(folder.glob(".*.part"))


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
    child = (
        "import sys, os; from langflash_core import files; from pathlib import Path\n"
        "part = files.part_beside(Path(sys.argv[1]) / 'a\\nb'); part.touch(); os._exit(0)"
    )
    subprocess.run([sys.executable, "-c", child, str(tmp_path)], check=True)
    assert len(_parts(tmp_path)) == 1
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
    child = (
        "import sys, os; from langflash_core.files import filled_atomically; from pathlib import Path\n"
        "with filled_atomically(Path(sys.argv[1]) / 'room') as staging:\n"
        "    (staging / 'scene').touch()\n    os._exit(0)"
    )
    subprocess.run([sys.executable, "-c", child, str(tmp_path)], check=True)
    assert len(_parts(tmp_path)) == 1
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
    assert _parts(place) == []


def test_a_killed_process_holds_nothing(tmp_path):
    child = (
        "import sys, os; from langflash_core.files import held_alone; from pathlib import Path\n"
        "with held_alone(Path(sys.argv[1])):\n    os._exit(0)"
    )
    subprocess.run([sys.executable, "-c", child, str(tmp_path)], check=True)
    assert len(_parts(tmp_path)) == 1
    with held_alone(tmp_path):
        assert len(_parts(tmp_path)) == 1
