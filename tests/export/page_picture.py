"""The guide's picture of a web page: a wide window and a phone.

python -m tests.export.page_picture assets/readme/page.jpg
"""

import io
import sys
import tempfile
from pathlib import Path

from PIL import Image

import langflash_core as lf
from langflash_core import pipeline
from langflash_core.base.resources import asset_path
from tests.export.browser import Browser, browser

GAP = 16  # pixels
WIDE, PHONE = (1040, 720), (360, 720)
_RESTED = """new Promise((done) => {
  const pending = () => document.querySelector("[data-state=pending]");
  const rested = () => (pending() ? setTimeout(rested, 100) : setTimeout(done, 1500));
  langflash.then(rested);
})"""


def picture() -> Image.Image:
    """Both, side by side."""
    photos = [asset_path(f"photos/living_room_{side}.png") for side in ("left", "right")]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "living room.html"
        pipeline.web_page(lf.reconstruct(photos), file, ["plant", "floor", "window", "piano"])
        with browser(Path(folder) / "profile") as page:
            page.open(file, WIDE)
            page.value(_RESTED)
            page.drag((500, 300), (535, 306))
            page.value(_RESTED)
            wide = _shown(page)
            page.open(file, PHONE, "#mode=photo", touch=True)
            page.value(_RESTED)
            page.value("document.getElementById('box').focus()")
            page.type("cha")
            page.value(_RESTED)
            phone = _shown(page)
    both = Image.new("RGB", (WIDE[0] + GAP + PHONE[0], WIDE[1]), "white")
    both.paste(wide, (0, 0))
    both.paste(phone, (WIDE[0] + GAP, 0))
    return both


def _shown(page: Browser) -> Image.Image:
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


if __name__ == "__main__":
    picture().save(sys.argv[1], quality=88, optimize=True)
