"""The order that moving pictures have at worst, so that what it costs can be measured."""

from langflash_core.types import Camera

from ..gl.splats import SplatBuffers


class StaleOrder(SplatBuffers):
    """Draws in the order of the last `sort_for`, as what moves does at worst: found quickly, and late."""

    def sort(self, camera: Camera) -> None:
        if not len(self.order):
            super().sort(camera)

    def sort_for(self, camera: Camera) -> None:
        self.draw_in(self._ordering.quick(camera))
