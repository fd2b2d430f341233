"""Downloads from a local server that knows ranges: progress, resume, checksums, refusals."""

import hashlib
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from langflash_core.errors import DownloadError
from langflash_core.network.checkpoints.download import download

CONTENT = bytes(range(256)) * 12_000  # three blocks


@dataclass
class Shelf:
    """What the server has, and how it misbehaves."""

    content: bytes = CONTENT
    tag: str = '"v1"'
    cut: int | None = None  # bytes after which the connection breaks
    linked: str = ""
    ranges: list[str | None] = field(default_factory=list)
    url: str = ""


@pytest.fixture
def shelf() -> Iterator[Shelf]:
    held = Shelf()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            if self.path == "/hub":
                self.send_response(302)
                self.send_header("Location", "/file")
                self.send_header("X-Linked-Etag", held.linked)
                self.end_headers()
                return
            if self.path != "/file":
                self.send_error(404, "Not Found")
                return
            asked = self.headers.get("Range")
            held.ranges.append(asked)
            start = 0
            if asked and self.headers.get("If-Range") == held.tag:
                start = int(asked.removeprefix("bytes=").rstrip("-"))
                if start > len(held.content):
                    self.send_error(416)
                    return
                self.send_response(206)
            else:
                self.send_response(200)
            self.send_header("Content-Length", str(len(held.content) - start))
            self.send_header("ETag", held.tag)
            self.end_headers()
            self.wfile.write(held.content[start : held.cut])
            if held.cut is not None:
                self.close_connection = True

        def log_message(self, format, *args):
            """Silence."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    held.url = f"http://127.0.0.1:{server.server_port}"
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield held
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_file_arrives_whole_with_progress(shelf, tmp_path):
    steps: list[tuple[str, float]] = []
    path = download(f"{shelf.url}/file", tmp_path / "sub" / "x.ckpt", lambda s, f: steps.append((s, f)))
    assert path.read_bytes() == CONTENT
    assert steps[-1] == ("3.1 of 3.1 MB", 1.0)
    assert [f for _, f in steps] == sorted(f for _, f in steps)
    assert list(path.parent.iterdir()) == [path]


def test_a_broken_download_continues(shelf, tmp_path):
    shelf.cut = 1_500_000
    with pytest.raises(DownloadError, match=r"broke off after 1\.5 of 3\.1 MB.*continues"):
        download(f"{shelf.url}/file", tmp_path / "x.ckpt")
    assert not (tmp_path / "x.ckpt").exists()
    shelf.cut = None
    assert download(f"{shelf.url}/file", tmp_path / "x.ckpt").read_bytes() == CONTENT
    assert shelf.ranges == [None, "bytes=1500000-"]
    assert [p.name for p in tmp_path.iterdir()] == ["x.ckpt"]


def test_another_file_on_the_server_starts_anew(shelf, tmp_path):
    shelf.cut = 1_500_000
    with pytest.raises(DownloadError):
        download(f"{shelf.url}/file", tmp_path / "x.ckpt")
    shelf.cut, shelf.content, shelf.tag = None, CONTENT[::-1], '"v2"'
    assert download(f"{shelf.url}/file", tmp_path / "x.ckpt").read_bytes() == CONTENT[::-1]


def test_a_partial_file_that_is_too_long_starts_anew(shelf, tmp_path):
    (tmp_path / "x.ckpt.partial").write_bytes(CONTENT + b"more")
    (tmp_path / "x.ckpt.partial.tag").write_text(shelf.tag)
    assert download(f"{shelf.url}/file", tmp_path / "x.ckpt").read_bytes() == CONTENT


@pytest.mark.parametrize("where", ["tag", "linked"])
def test_the_checksum_that_the_server_names_is_checked(shelf, tmp_path, where):
    right = hashlib.sha256(CONTENT).hexdigest()
    url = f"{shelf.url}/{'hub' if where == 'linked' else 'file'}"
    setattr(shelf, where, f'"{right}"')
    assert download(url, tmp_path / "good.ckpt").read_bytes() == CONTENT
    setattr(shelf, where, '"' + "0" * 64 + '"')
    with pytest.raises(DownloadError, match="damaged"):
        download(url, tmp_path / "bad.ckpt")
    assert [p.name for p in tmp_path.iterdir()] == ["good.ckpt"]


def test_refusals_and_silence_are_one_sentence(shelf, tmp_path):
    with pytest.raises(DownloadError, match=r"refused .404"):
        download(f"{shelf.url}/nothing", tmp_path / "x")
    with pytest.raises(DownloadError, match=r"could not be downloaded.*weights import"):
        download("http://127.0.0.1:1/file", tmp_path / "x")
    assert not list(Path(tmp_path).iterdir())
