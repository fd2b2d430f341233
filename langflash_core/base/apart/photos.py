"""HEIC and AVIF, decoded by libheif and libavif through Pillow: pixels, and what the file says of them."""

import io
import warnings
from collections.abc import Iterator
from typing import Any

from PIL import Image

KEPT = ("exif", "icc_profile", "xmp")  # blocks that go on, as bytes


def answers(reader: str, request: dict[str, Any], content: bytes) -> Iterator[tuple[dict, dict]]:
    """Pixels of the first picture: facts mode, width and height, bytes "pixels" and those of `KEPT`.

    Args:
        request: "pixels": the most; "profile": the most bytes of a block of `KEPT`, larger ones are left out.

    Raises:
        ValueError, OSError: it has more of them, is damaged, or no HEIC or AVIF.
    """
    if content[8:12] not in (b"avif", b"avis"):
        import pillow_heif

        pillow_heif.register_heif_opener()
    Image.init()
    Image.MAX_IMAGE_PIXELS = None  # its own bound; the one below counts
    known = [kind for kind in ("HEIF", "AVIF") if kind in Image.OPEN]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with Image.open(io.BytesIO(content), formats=known) as opened:
            facts = {"mode": opened.mode, "width": opened.width, "height": opened.height}
            if opened.width * opened.height > request["pixels"]:
                yield facts, {}
                return
            opened.load()
            facts["mode"] = opened.mode
            blocks = {name: opened.info.get(name) for name in KEPT}
            kept = {
                n: b for n, b in blocks.items() if isinstance(b, bytes) and 0 < len(b) <= request["profile"]
            }
            yield facts, {"pixels": opened.tobytes(), **kept}
