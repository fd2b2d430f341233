"""What a scene is to be made of, and how: one frozen record of what `pipeline.reconstruct` was asked."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from jaxtyping import Float
from torch import Tensor

from langflash_core.base.detail import DEFAULT_DETAIL, check_gaussians, chosen_detail
from langflash_core.base.devices import chosen_device
from langflash_core.images.lens import Intrinsics


@dataclass(frozen=True)
class Options:
    """Fields as the arguments of `pipeline.reconstruct`."""

    photos: Sequence[Path | str]
    preset: str = "mini"
    weights: Path | str | None = None
    fov: float | Sequence[float | None] | None = None
    intrinsics: Intrinsics | Sequence[Intrinsics] | None = None
    size: int | None = None
    device: str = "auto"
    precision: str = "auto"
    aggregation: str | None = None
    grouping: str | None = None
    detail: str | None = DEFAULT_DETAIL
    gaussians: int | None = None
    viewmats: Float[Tensor, "V 4 4"] | None = None
    keep: Path | None = None

    def settled(self) -> "Options":
        """The same with the device that there is, once all was checked that can be before a photo is read.

        Raises:
            InputError: the device, the detail or the number of Gaussians cannot be had.
        """
        device = chosen_device(self.device)
        if self.detail is not None:
            chosen_detail(self.detail)
        check_gaussians(self.gaussians)
        return replace(self, device=device)
