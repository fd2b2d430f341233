"""What regresses SAM's dense embedding while the grouping learns.

Sizes: B scenes, V views, h w the teacher's grid, f channels of the map that masks are read from.
"""

from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.lab.training.losses import teacher_loss
from langflash_core.network.encoders.mobile_sam import CHANNELS


class Student(nn.Conv2d):
    """The finest map to the teacher's channels. It learns with the stage and goes when the stage is over."""

    def __init__(self, channels: int) -> None:
        super().__init__(channels, CHANNELS, 1)

    def loss(self, maps: Tensor, dense: Tensor) -> Tensor:
        """Of maps (B*V, f, H, W) and the embedding of the same views (B, V, 256, h, w).

        Maps are averaged over the teacher's cells first, so that what lies between them is free.
        """
        said = self(F.adaptive_avg_pool2d(maps, (dense.shape[-2], dense.shape[-1])))
        return teacher_loss(said, dense.flatten(0, 1))
