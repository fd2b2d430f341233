import os
import subprocess
import sys
from pathlib import Path

import pytest

from langflash_core.base import files
from langflash_core.base.files import check_folder, check_output_file, move_all, staged_folder
from langflash_core.errors import OutputError


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


def test_what_a_killed_process_leaves_goes_at_the_next_write(tmp_path):
    code = """if True:
        import os, sys
        from pathlib import Path
        from langflash_core.base.files import staged_folder

        with staged_folder(Path(sys.argv[1]) / "new") as staging:
            (staging / "x.txt").write_bytes(b"x")
            os._exit(9)
    """
    assert subprocess.run([sys.executable, "-c", code, str(tmp_path)]).returncode == 9
    assert len(os.listdir(tmp_path)) == 1
    with staged_folder(tmp_path / "new") as staging:
        (staging / "x.txt").write_bytes(b"x")
    assert os.listdir(tmp_path) == ["new"]


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
    gone = f".export.{files._host()}-{2**22 + 7}-0123456789ab.part"  # no process has such a number
    (tmp_path / gone).mkdir()
    (tmp_path / gone / "half").write_bytes(b"x")
    (tmp_path / "out").mkdir()
    with staged_folder(tmp_path / "out") as staging:
        (staging / "a").write_bytes(b"whole")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
