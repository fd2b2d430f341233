"""One large file over HTTP: with progress, continued where it stopped, checked when it is whole.

What has arrived is kept beside the target as `NAME.partial`, with the server's tag of the file in
`NAME.partial.tag`; both vanish when the file is whole.
"""

import hashlib
import http.client
import urllib.error
import urllib.request
from dataclasses import dataclass
from pathlib import Path

from langflash_core.base.files import make_folder
from langflash_core.base.running import Progress
from langflash_core.errors import DownloadError

TIMEOUT = 30.0  # seconds without a byte
_BLOCK = 1 << 20


@dataclass(frozen=True)
class _Answer:
    """What the server says of the file: whole size in bytes (None: unknown), its tag, its SHA-256."""

    size: int | None
    tag: str
    checksum: str


class _Redirects(urllib.request.HTTPRedirectHandler):
    """Remembers the checksum that a hub names when it redirects to its storage."""

    def __init__(self) -> None:
        self.tag = ""

    def redirect_request(self, req, fp, code, msg, headers, newurl):
        self.tag = self.tag or headers.get("X-Linked-Etag", "")
        return super().redirect_request(req, fp, code, msg, headers, newurl)


def download(url: str, path: Path, progress: Progress | None = None) -> Path:
    """Fetch `url` to `path`.

    Args:
        progress: called with what is done and the fraction in [0, 1].

    Raises:
        DownloadError: no connection, a refusal, a connection that broke (run again: it continues),
            or bytes that do not have the checksum the server names.
        OutputError: the folder cannot be written.
    """
    make_folder(path.parent)
    partial, tag = path.with_name(path.name + ".partial"), path.with_name(path.name + ".partial.tag")
    answer = _fetch(url, partial, tag, progress)
    size = partial.stat().st_size
    if answer.size is not None and size != answer.size:
        raise DownloadError(
            f"{url} broke off after {_megabytes(size)} of {_megabytes(answer.size)} MB; "
            "run the same command again, it continues there"
        )
    if answer.checksum and _checksum(partial) != answer.checksum:
        partial.unlink()
        tag.unlink(missing_ok=True)
        raise DownloadError(f"{url} arrived damaged (its SHA-256 is another); run the same command again")
    partial.replace(path)
    tag.unlink(missing_ok=True)
    return path


def _fetch(url: str, partial: Path, tag: Path, progress: Progress | None) -> _Answer:
    """Append what is missing to `partial`."""
    have = partial.stat().st_size if partial.exists() and tag.exists() else 0
    request = urllib.request.Request(url, headers={"User-Agent": "langflash"})
    if have:
        request.add_header("Range", f"bytes={have}-")
        request.add_header("If-Range", tag.read_text(encoding="utf-8"))
    redirects = _Redirects()
    try:
        with urllib.request.build_opener(redirects).open(request, timeout=TIMEOUT) as response:
            continued = response.status == 206
            answer = _read_answer(response, have if continued else 0, redirects.tag)
            tag.write_text(answer.tag, encoding="utf-8")
            _copy(response, partial, have if continued else 0, answer.size, progress)
            return answer
    except urllib.error.HTTPError as error:
        error.close()
        if error.code == 416 and have:  # the partial file is no beginning of this one
            partial.unlink()
            return _fetch(url, partial, tag, progress)
        raise DownloadError(f"{url} was refused ({error.code} {error.reason}); check the address") from None
    except http.client.IncompleteRead:
        return answer  # the size tells
    except (OSError, http.client.HTTPException) as error:
        reason = getattr(error, "reason", None) or error
        raise DownloadError(
            f"{url} could not be downloaded ({reason}); check the network and run the same command again, "
            "or download the file by hand and use `langflash weights import`"
        ) from None


def _read_answer(response, have: int, linked: str) -> _Answer:
    length = response.headers.get("Content-Length")
    tag = response.headers.get("ETag", "")
    checksums = [t.removeprefix("W/").strip('"').lower() for t in (linked, tag)]
    checksum = next((c for c in checksums if len(c) == 64 and set(c) <= set("0123456789abcdef")), "")
    return _Answer(None if length is None else have + int(length), tag, checksum)


def _copy(response, partial: Path, have: int, size: int | None, progress: Progress | None) -> None:
    with partial.open("ab" if have else "wb") as stream:
        while block := response.read(_BLOCK):
            stream.write(block)
            have += len(block)
            if progress is not None:
                whole = f" of {_megabytes(size)}" if size else ""
                progress(f"{_megabytes(have)}{whole} MB", have / size if size else 0.0)


def _checksum(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _megabytes(size: int) -> str:
    return f"{size / 1e6:,.1f}"
