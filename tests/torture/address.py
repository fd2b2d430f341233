"""Addresses that strangers link to, for the page's own reader, in a browser: nothing is thrown, and what
comes is a view and a phrase that the page has.

    python -m tests.torture address [--seed 1] [--addresses 1000000]
"""

import json
from collections.abc import Iterator
from pathlib import Path

from langflash_core import pipeline
from tests.export.browser import browser
from tests.torture.rows import Row

READER = Path(pipeline.__file__).parent / "export" / "page" / "address.js"
AT_ONCE = 100_000
_FUZZ = """
(() => {
  READER
  let state = SEED >>> 0;
  const random = (most) => {  // xorshift
    state ^= state << 13; state >>>= 0; state ^= state >>> 17; state ^= state << 5; state >>>= 0;
    return state % most;
  };
  const texts = ["plant", "length", "a b", "", "%", "\\u0000", "constructor"];
  const stops = ["The window", "length", ""];
  const words = ["view", "stop", "plan", "The window", "ask", "mode", "bare", "=", "&", "#", "%", "%zz",
    "%00", "+", "plant", "length",
    "map", "constructor", "__proto__", "toString", "0", "1", "-1", "1e9", "99999999999999999999", "0x1", " 1",
    "1.5", "NaN", "Infinity", "photo", "heat", "\\ud800", "\\u202e", "\\u0000", "<script>", "[]",
    "view=length", "view=1", "photo=1", "photo=0", "?", ";"];
  const finds = [];
  for (let number = 0; number < COUNT && finds.length < 5; number++) {
    let hash = random(9) ? "#" : "";
    for (let part = random(12); part > 0; part--)
      hash += random(6) ? words[random(words.length)] : String.fromCharCode(random(65536));
    if (random(50) === 0) hash = hash.repeat(1 + random(300));
    const views = 1 + random(4);
    try {
      const said = readAddress(hash, views, stops, texts);
      const whole = Number.isInteger(said.view) && said.view >= -1 && said.view < views
        && Number.isInteger(said.stop) && said.stop >= -1 && said.stop < stops.length
        && typeof said.plan === "boolean"
        && Number.isInteger(said.row) && said.row >= -1 && said.row < texts.length
        && typeof said.bare === "boolean" && typeof said.heat === "boolean";
      if (!whole) finds.push([hash.slice(0, 200), JSON.stringify(said)]);
    } catch (error) {
      finds.push([hash.slice(0, 200), String(error)]);
    }
  }
  return finds;
})()
"""


def torture(folder: Path, count: int, seed: int) -> list[tuple[str, str]]:
    """Addresses that broke it, each with what was wrong."""
    reader = READER.read_text("utf-8")
    finds: list[tuple[str, str]] = []
    with browser(folder) as page:
        for start in range(0, count, AT_ONCE):
            script = _FUZZ.replace("SEED", str(seed * 7919 + start + 1))
            script = script.replace("COUNT", str(min(AT_ONCE, count - start))).replace("READER", reader)
            finds += [tuple(each) for each in page.value(script)]
    return finds


def everything(folder: Path, count: int, seed: int) -> Iterator[Row]:
    """The one row."""
    finds = [f"{json.dumps(found)}: {wrong}" for found, wrong in torture(folder, count, seed)]
    yield Row("addresses", f"{count:,}", finds)
