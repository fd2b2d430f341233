"""The page of a run: failures first, its links lead somewhere, and it needs no other file."""

import re
from urllib.parse import unquote

from langflash_core.batch.ledger import Row
from langflash_core.batch.sets import SUMMARY
from langflash_core.batch.summary import THUMBNAIL, write_summary

ROWS = [
    Row("den & <b>", "done", photos=2, gaussians=10, warnings="one | two"),
    Row("hall", "failed", "no <picture>; take another", retried=1),
    Row("50% off?#", "done"),
]


def test_page(tmp_path):
    for row in ROWS:
        if row.status == "done":
            (tmp_path / row.name / "answers").mkdir(parents=True)
            (tmp_path / row.name / "scene.langflash").touch()
            (tmp_path / row.name / THUMBNAIL).write_bytes(b"jpeg")
    (tmp_path / "ledger.csv").touch()
    write_summary(ROWS, tmp_path)
    page = (tmp_path / SUMMARY).read_text()
    assert "2 done, 1 failed" in page
    assert page.index("hall") < page.index("den &amp; &lt;b&gt;") < page.index("50% off?#")
    assert "no &lt;picture&gt;; take another" in page and "<picture>" not in page and "<b>" not in page
    assert "<small>one</small><small>two</small>" in page
    links = re.findall(r'href="([^"]+)"', page)
    assert len(links) == 7 and all(
        (tmp_path / unquote(link).replace("&amp;", "&")).exists() for link in links
    )
    assert set(re.findall(r'src="([^"]+)"', page)) == {"data:image/jpeg;base64,anBlZw=="}


def test_no_sets(tmp_path):
    write_summary([], tmp_path)
    assert "0 done" in (tmp_path / SUMMARY).read_text()


def test_a_folder_that_was_taken_away(tmp_path):
    write_summary([Row("gone", "done")], tmp_path)
    assert "gone" in (tmp_path / SUMMARY).read_text()


def test_clips_are_called_clips_and_have_frames_and_objects(tmp_path):
    write_summary([Row("hall", "done", photos=24, groups=7, found="97% covered")], tmp_path, "clip")
    page = (tmp_path / SUMMARY).read_text()
    assert "LangFlash: 1 clips" in page
    headings = re.findall(r"<th>([^<]*)</th>", page)
    cells = re.findall(r'<td class="number"[^>]*>([^<]*)</td>', page)
    assert dict(zip(headings[3:], cells, strict=False))["objects"] == "7"
    assert headings == ["", "clip", "status", "seconds", "frames", "objects", "quality", "retried", "files"]
