"""Where points lie in photos: any number of photos at once, on any device. Pixel centres at +0.5."""

from dataclasses import dataclass
from functools import cached_property

import torch
from jaxtyping import Bool, Float, Int, Shaped
from torch import Tensor

from langflash_core.geometry.pinhole import to_pixels


@dataclass(frozen=True)
class Projected:
    """Points in pictures. x, y: pixels; z: depth, in the unit of the points; far off where that is 0 or less.
    size: (height, width) of the pictures, pixels."""

    x: Float[Tensor, "*b n"]
    y: Float[Tensor, "*b n"]
    z: Float[Tensor, "*b n"]
    size: tuple[int, int]

    @cached_property
    def inside(self) -> Bool[Tensor, "*b n"]:
        """Before the camera and in its picture; never of what is no number."""
        height, width = self.size
        return (self.z > 0) & (self.x >= 0) & (self.y >= 0) & (self.x < width) & (self.y < height)

    def within(self, margin: float) -> Bool[Tensor, "*b n"]:
        """As `inside`, and more than so many pixels from the picture's border."""
        height, width = self.size
        across = (self.x > margin) & (self.x < width - margin)
        return (self.z > 0) & across & (self.y > margin) & (self.y < height - margin)

    @cached_property
    def pixels(self) -> Int[Tensor, "*b n"]:
        """Numbers of the pixels that show them, row by row; 0 outside."""
        return torch.where(self.inside, self.y.floor() * self.size[1] + self.x.floor(), 0.0).long()

    @property
    def normalised_coordinates(self) -> tuple[Float[Tensor, "*b n"], Float[Tensor, "*b n"]]:
        """x and y, -1 to 1 over the picture."""
        height, width = self.size
        return self.x / width * 2 - 1, self.y / height * 2 - 1

    def looked_up(self, maps: Shaped[Tensor, "*b m"]) -> Shaped[Tensor, "*b n"]:
        """What flat maps of the pictures say where the points lie; that of pixel 0 outside."""
        return maps.index_select(0, self.pixels) if maps.ndim == 1 else maps.gather(-1, self.pixels)


def project_points(
    points: Float[Tensor, "*#b 3 n"],
    viewmats: Float[Tensor, "*b 4 4"],
    Ks: Float[Tensor, "*b 3 3"],
    size: tuple[int, int],
) -> Projected:
    """Points, a row an axis, in one picture or in several of one size.

    Args:
        points: of the world, the same for all pictures or each one's own. viewmats: world to camera. Ks:
            pixels of pictures of `size` = (height, width).
    """
    return see_points(viewmats[..., :3, :3] @ points + viewmats[..., :3, 3:], Ks, size)


def see_points(
    points: Float[Tensor, "*b 3 n"], Ks: Float[Tensor, "*b 3 3"], size: tuple[int, int], eps: float = 1e-8
) -> Projected:
    """`project_points` of points in the frame of the camera, or each in that of its own.

    A row an axis is the layout that a processor goes through fastest. eps: the least depth by which x and y
    are divided.
    """
    x, y, z = points.unbind(-2)
    return Projected(*to_pixels(x, y, z.clamp_min(eps), Ks), z, size)
