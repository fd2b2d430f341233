"""How far a picture can be trusted: what the photos looked at from about there, and what they did not.

A surface is known from the direction that a photo looked at it from. From elsewhere it shows sides that
nobody saw: the scene guesses, and the farther aside, the worse. The measure is the angle, at the surface,
between the camera and the nearest photo; no photo has to be recomputed for it.

Sizes: V photos, H W pixels.
"""

import math
from dataclasses import replace

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid, transform, unproject
from langflash_core.scene.settings import TRUST
from langflash_core.types import Camera, Frame, Scene

COSINES = math.cos(math.radians(TRUST.none)), math.cos(math.radians(TRUST.full))


def trust(
    points: Float[Tensor, "*n 3"], eye: Float[Tensor, "*#n 3"], eyes: Float[Tensor, "V 3"]
) -> Float[Tensor, "*n"]:
    """How far surfaces are known as they are seen from `eye`, in [0, 1]; exactly 1 from a photo's own place.

    Smoothstep of the cosine of the angle to the nearest photo, between `TRUST.none` and `TRUST.full` degrees.

    Args:
        points: on surfaces. eyes: places of the photos; all in one world.
    """
    way = torch.nn.functional.normalize(eye - points, dim=-1)
    nearest = way.new_full(way.shape[:-1], -1.0)
    for photo in eyes:  # one after the other: all at once would be V pictures of vectors
        ways = torch.nn.functional.normalize(photo - points, dim=-1)
        nearest = torch.maximum(nearest, (ways * way).sum(-1))
    low, high = COSINES
    share = ((nearest - low) / (high - low)).clamp(0, 1)
    return share * share * (3 - 2 * share)


def check_photos(scene: Scene) -> None:
    """Raises:
    InputError: nobody knows the photos that the scene was made of.
    """
    if scene.view_ids is None:
        raise InputError("this scene does not say which photos it was made of; leave --fade out")


def fade_untrusted(frame: Frame, camera: Camera, scene: Scene) -> Frame:
    """A frame over black that fades where it shows what no photo looked at from about there.

    Colours, alphas and weight maps are multiplied by `trust`, so that what is not to be trusted is not
    covered, in answers and exports too. Equal, bit by bit, from the photos' own places.

    Args:
        frame: of `scene`, drawn by `camera`.

    Raises:
        InputError: nobody knows the photos that the scene was made of.
    """
    check_photos(scene)
    pose = invert_rigid(camera.viewmat.to(frame.depths))
    points = transform(
        pose, unproject(frame.depths, camera.K.to(frame.depths), camera.orthographic).flatten(0, 1)
    )
    eye = points - pose[:3, 2] if camera.orthographic else pose[:3, 3]  # or whence each ray comes
    eyes = invert_rigid(scene.viewmats.to(frame.depths))[:, :3, 3]
    known = trust(points, eye, eyes).unflatten(0, frame.depths.shape)
    known = torch.where(frame.depths > 0, known, torch.ones_like(known))  # too thin to have a depth
    return replace(
        frame,
        rgb=frame.rgb * known[..., None],
        alphas=frame.alphas * known,
        depths=torch.where(known > 0, frame.depths, torch.zeros_like(frame.depths)),
        weight_maps=None if frame.weight_maps is None else frame.weight_maps * known[..., None],
    )
