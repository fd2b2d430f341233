"""Thumbnails on the graphics card, by key, within bounds."""

import moderngl
import numpy as np
from imgui_bundle import imgui

from langflash_core.base.picture_files import STORED, opened_picture

MOST_BYTES = 96 * 2**20  # 400 photos of the tray, or 3,500 atoms


class Thumbnails:
    """Small pictures of `ctx`. Main thread only; `release` may be called twice.

    Together they take at most `most_bytes`, or the newest one alone: those that nobody asked for longest go.
    """

    def __init__(self, ctx: moderngl.Context, most_bytes: int = MOST_BYTES) -> None:
        self._ctx = ctx
        self._most_bytes = most_bytes
        self._textures: dict[str, moderngl.Texture] = {}

    def put(self, key: str, rgb: np.ndarray) -> None:
        """Upload rgb (h, w, 3) uint8 under `key`, replacing what was there."""
        self.drop(key)
        height, width = rgb.shape[:2]
        texture = self._ctx.texture((width, height), 3, np.ascontiguousarray(rgb).tobytes(), alignment=1)
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
        self._textures[key] = texture
        total = sum(3 * each.width * each.height for each in self._textures.values())
        while total > self._most_bytes and len(self._textures) > 1:
            oldest = next(iter(self._textures))
            total -= 3 * self._textures[oldest].width * self._textures[oldest].height
            self.drop(oldest)

    def put_encoded(self, key: str, encoded: bytes) -> None:
        """Upload a small JPEG.

        Raises:
            OSError, SyntaxError, ValueError: the bytes are no picture.
        """
        with opened_picture(encoded, STORED) as photo:
            self.put(key, np.asarray(photo.convert("RGB")))

    def get(self, key: str) -> tuple[imgui.ImTextureRef, float] | None:
        """The picture and its width / height; None when there is none (yet)."""
        texture = self._textures.pop(key, None)
        if texture is None:
            return None
        self._textures[key] = texture  # the last to go
        return imgui.ImTextureRef(texture.glo), texture.width / texture.height

    def drop(self, key: str) -> None:
        """Free one picture, if it is there."""
        texture = self._textures.pop(key, None)
        if texture is not None:
            texture.release()

    def release(self) -> None:
        """Free every picture."""
        for texture in self._textures.values():
            texture.release()
        self._textures.clear()
