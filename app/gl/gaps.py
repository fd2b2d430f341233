"""What shows through the gaps of a picture, on the graphics card; see langflash_core/scene/gaps.py."""

from collections.abc import Hashable, Iterator
from itertools import pairwise

import moderngl

from langflash_core.scene.gaps import num_levels

from .painter import Painter

BEHIND = (moderngl.ONE_MINUS_DST_ALPHA, moderngl.ONE)  # premultiplied, what is there stays in front


class Gaps:
    """Owns the coarser pictures of one size, float16; about a third of the picture's pixels."""

    def __init__(self, painter: Painter, size: tuple[int, int]):
        self._painter = painter
        self._levels: list[tuple[moderngl.Texture, moderngl.Framebuffer]] = []
        self._key: Hashable = None
        for _ in range(num_levels(*size)):
            size = (-(-size[0] // 2), -(-size[1] // 2))
            texture = painter.ctx.texture(size, 4, dtype="f2")
            texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
            texture.repeat_x = texture.repeat_y = False
            self._levels.append((texture, painter.ctx.framebuffer([texture])))

    def of(self, colour: moderngl.Texture, depth: moderngl.Texture, key: Hashable) -> moderngl.Texture:
        """Half the size, premultiplied; drawn where `key` differs from the last time.

        Args:
            colour: premultiplied. depth: its second channel is the sum of T alpha.
        """
        if key != self._key:
            for _ in self.passes(colour, depth):
                pass
            self._painter.passes["gaps"] += 1
            self._key = key
        return self._levels[0][0]

    def passes(self, colour: moderngl.Texture, depth: moderngl.Texture) -> Iterator[None]:
        """Draw them, a pass a step."""
        self._key = None
        fill = self._painter.fill
        fill(self._levels[0][1], "pull.frag", {"colour": colour, "depth": depth}, defines={"FIRST": 1})
        for (fine, _), (_, into) in pairwise(self._levels):
            yield
            fill(into, "pull.frag", {"colour": fine})
        for (_, into), (coarse, _) in reversed(list(pairwise(self._levels))):
            yield
            fill(into, "push.frag", {"gaps": coarse}, blend=BEHIND)

    def release(self) -> None:
        for texture, framebuffer in self._levels:
            framebuffer.release()
            texture.release()
        self._levels.clear()
        self._key = None
