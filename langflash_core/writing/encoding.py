"""Pictures to a film by ffmpeg, in a process of its own; what it says at its end is heard.

imageio-ffmpeg brings the program. Its own way of writing leaves ffmpeg's exit code unread: on a full disk a
film that breaks off would be taken for a whole one.
"""

import os
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from langflash_core.errors import LangFlashError, OutputError
from langflash_core.geometry.tours import RATE

_H264 = (
    "libx264", "-pix_fmt", "yuv420p", "-crf", "10", "-preset", "veryfast",
    "-vf", "scale=out_color_matrix=bt709:out_range=tv",
    "-x264-params", "colorprim=bt709:transfer=iec61966-2-1:colormatrix=bt709:range=tv",
)  # fmt: skip
"""The preset takes half the encoder's time of the usual one; files grow a little. Pictures are sRGB, and the
file says so: unsaid, ffmpeg writes the matrix of BT.601, and players take large films for BT.709's."""
_WEBP = (
    "libwebp_anim", "-pix_fmt", "yuv420p", "-quality", "80", "-compression_level", "2", "-loop", "0",
)  # fmt: skip


@contextmanager
def open_encoder(path: Path, size: tuple[int, int]) -> Iterator[Callable[[bytes], object]]:
    """A function that takes pictures, (H, W, 3) bytes each, one after the other; the film is whole where the
    block ends well. H.264, or for a .webp an animation that begins again at its end.

    Args:
        size: width and height, even.

    Raises:
        OutputError: the disk is full, or the encoder stopped otherwise.
        LangFlashError: it cannot be started.
    """
    with tempfile.TemporaryFile() as complaints:
        encoder = _start_ffmpeg(path, size, complaints)
        assert encoder.stdin is not None
        try:
            with suppress(BrokenPipeError):  # it is gone, and has said why
                yield encoder.stdin.write  # pyright: ignore[reportReturnType] - it takes more than bytes
                encoder.stdin.close()
            code = encoder.wait()
        finally:
            encoder.kill()
            encoder.wait()
            with suppress(OSError):
                encoder.stdin.close()
        if code:
            complaints.seek(0)
            raise OutputError(
                f"cannot write {path.name}: {_why(complaints.read(), code)}; choose another place"
            )


def _start_ffmpeg(path: Path, size: tuple[int, int], complaints) -> subprocess.Popen:
    import imageio_ffmpeg

    codec = _WEBP if path.suffix.lower() == ".webp" else _H264
    picture = ("-f", "rawvideo", "-s", f"{size[0]}x{size[1]}", "-pix_fmt", "rgb24", "-r", str(RATE))
    words = ("-y", "-v", "error", *picture, "-i", "-", "-an", "-vcodec", *codec, str(path))
    try:
        return subprocess.Popen(
            [imageio_ffmpeg.get_ffmpeg_exe(), *words],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=complaints,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            process_group=0 if os.name == "posix" else None,  # Ctrl-C ends us, and we end it
        )  # fmt: skip
    except (OSError, RuntimeError) as error:  # RuntimeError: there is no ffmpeg
        raise LangFlashError(
            f"the video encoder cannot be started ({error}); choose another format"
        ) from error


def _why(said: bytes, code: int) -> str:
    """Its last word, or how it ended."""
    lines = [line.rpartition("] ")[2] for line in said.decode(errors="replace").splitlines() if line.strip()]
    return (
        f"the video encoder stopped ({lines[-1][:120]})" if lines else f"the video encoder ended with {code}"
    )
