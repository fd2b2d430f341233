"""Readers that are not ours and not memory-safe (OpenUSD, the decoders of films, HEIC and AVIF), each in a
process of its own: what a hostile file does to them stays there.

`ask` (`process.py`) starts one, or takes one that waits, and gives its answers as plain numbers and arrays.
The other side is `serving.py`, which calls `photos.py`, `films.py` or `stages.py`. Limits on memory and time
are those of `base/limits.py`; whatever ends such a process is one sentence here. No object ever crosses:
an answer is JSON and bytes whose types and sizes are checked, for a reader that was taken over could
send anything.
Nothing in this folder imports torch.
"""

from langflash_core.base.apart.process import Ended, Part, Refused, ask

__all__ = ["Ended", "Part", "Refused", "ask"]
