"""From light to a photo: exposure, white balance, vignetting, noise, blur, tone, JPEG. H W pixels."""

import io
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image

from langflash_core.base.picture_files import opened_picture


@dataclass(frozen=True)
class Sensor:
    """How one camera sees; one set of values for all views of a scene.

    Attributes:
        level: brightness that the scene's middle is brought to, linear.
        balance: gains of red, green, blue.
        vignette: loss of light in the corner, [0, 1].
        noise: standard deviation at middle grey, linear.
        blur: weight of the neighbours in a 3-tap filter, [0, 0.25].
        quality: JPEG quality; 0 for none.
    """

    level: float = 0.22
    balance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    vignette: float = 0.0
    noise: float = 0.0
    blur: float = 0.0
    quality: int = 0


def random_sensor(rng: np.random.Generator) -> Sensor:
    """A plausible phone camera."""
    red, green, blue = (float(b) for b in np.exp(rng.normal(0, 0.06, 3) * [1.0, 0.3, 1.0]))
    return Sensor(
        level=float(rng.uniform(0.15, 0.32)),
        balance=(red, green, blue),
        vignette=float(rng.uniform(0.0, 0.3)),
        noise=float(rng.exponential(0.006)),
        blur=float(rng.uniform(0.0, 0.16)) if rng.random() < 0.5 else 0.0,
        quality=int(rng.integers(60, 97)) if rng.random() < 0.7 else 0,
    )


def meter(radiance: Float[np.ndarray, "H W 3"]) -> float:
    """The middle grey of a view: its geometric mean brightness, linear."""
    return max(float(np.exp(np.log(radiance.mean(-1) + 1e-3).mean())), 1e-3)


def expose(
    radiance: Float[np.ndarray, "H W 3"], sensor: Sensor, rng: np.random.Generator, grey: float
) -> UInt8[np.ndarray, "H W 3"]:
    """One photo of one view.

    Args:
        radiance: linear, >= 0.
        sensor: the camera.
        rng: noise.
        grey: what is brought to the sensor's level (`meter`); one value for all photos of a room
            locks the exposure, so that a wall keeps its brightness from photo to photo.

    Returns:
        sRGB photo.
    """
    light = (
        radiance
        * (sensor.level / grey)
        * np.array(sensor.balance, dtype=np.float32)
        * _falloff(radiance.shape[:2], sensor.vignette)
    )
    if sensor.blur > 0:
        light = _blur(light, sensor.blur)
    if sensor.noise > 0:
        spread = sensor.noise * np.sqrt(np.maximum(light, 0.0) / 0.18 + 0.15)
        light = light + spread * rng.standard_normal(light.shape, dtype=np.float32)
    photo = _to_srgb(_shoulder(np.maximum(light, 0.0)))
    return _jpeg(photo, sensor.quality) if sensor.quality else photo


def _falloff(size: tuple[int, int], vignette: float) -> Float[np.ndarray, "H W 1"]:
    v, u = (np.linspace(-1, 1, n, dtype=np.float32) for n in size)
    return (1.0 - 0.5 * vignette * (u[None] ** 2 + v[:, None] ** 2))[..., None]


def _blur(light: Float[np.ndarray, "H W 3"], weight: float) -> Float[np.ndarray, "H W 3"]:
    for axis in (0, 1):
        pad = [(1, 1) if k == axis else (0, 0) for k in range(3)]
        wide = np.pad(light, pad, mode="edge")
        before, after = (
            np.take(wide, np.arange(start, start + light.shape[axis]), axis=axis) for start in (0, 2)
        )
        light = (1 - 2 * weight) * light + weight * (before + after)
    return light


def _shoulder(light: Float[np.ndarray, "H W 3"]) -> Float[np.ndarray, "H W 3"]:
    """Linear in the shadows, bent towards 1 in the lights (extended Reinhard, white at 3)."""
    return light * (1 + light / 9.0) / (1 + 0.75 * light)


def _to_srgb(light: Float[np.ndarray, "H W 3"]) -> UInt8[np.ndarray, "H W 3"]:
    linear = np.clip(light, 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255).astype(np.uint8)


def _jpeg(photo: UInt8[np.ndarray, "H W 3"], quality: int) -> UInt8[np.ndarray, "H W 3"]:
    stream = io.BytesIO()
    Image.fromarray(photo).save(stream, "JPEG", quality=quality)
    with opened_picture(stream, ("JPEG",)) as picture:
        return np.asarray(picture.convert("RGB"))
