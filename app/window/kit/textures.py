"""Thumbnails on the graphics card, by key."""

import io

import moderngl
import numpy as np
from imgui_bundle import imgui
from PIL import Image


class Thumbnails:
    """Small pictures of `ctx`. Main thread only; `release` may be called twice."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._textures: dict[str, moderngl.Texture] = {}

    def put(self, key: str, rgb: np.ndarray) -> None:
        """Upload rgb (h, w, 3) uint8 under `key`, replacing what was there."""
        self.drop(key)
        height, width = rgb.shape[:2]
        texture = self._ctx.texture((width, height), 3, np.ascontiguousarray(rgb).tobytes(), alignment=1)
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
        self._textures[key] = texture

    def put_encoded(self, key: str, encoded: bytes) -> None:
        """Upload a small JPEG.

        Raises:
            OSError: the bytes are no picture.
        """
        with Image.open(io.BytesIO(encoded)) as photo:
            self.put(key, np.asarray(photo.convert("RGB")))

    def get(self, key: str) -> tuple[imgui.ImTextureRef, float] | None:
        """The picture and its width / height; None when there is none (yet)."""
        texture = self._textures.get(key)
        if texture is None:
            return None
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
