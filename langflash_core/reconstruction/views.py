"""What the network is shown: photos with given poses, straightened, with the lens that was found."""

from collections.abc import Callable
from dataclasses import replace

from jaxtyping import Float
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.images.straight import after, straighten_views
from langflash_core.types import Prediction, Views

_STRAIGHTENED = 3  # times, at most
_NOT_TOLD = "; the photos alone do not tell"


def posed_views(views: Views, viewmats: Float[Tensor, "V 4 4"] | None, preset: str) -> Views:
    """The views with the poses that were given, brought to the first camera.

    Raises:
        InputError: another preset, or not a pose for each photo.
    """
    if viewmats is None:
        return views
    if preset != "mini":
        raise InputError(f"the preset '{preset}' seeks poses itself; choose --preset mini for given ones")
    if tuple(viewmats.shape) != (views.num_views, 4, 4):
        raise InputError(f"{len(viewmats)} poses were given for {views.num_views} photos; give one each")
    relative = viewmats.double() @ invert_rigid(viewmats[0].double())
    return replace(views, viewmats=relative)


def straight_prediction(predict: Callable[[Views], Prediction], views: Views) -> tuple[Prediction, Views]:
    """A prediction, and the views it is of: straightened where their lenses bend lines.

    The first round sees a strong bend only where the photos hardly show it, so the photos are straightened by
    what all rounds say together, until nothing is left of it.
    """
    taken = views
    for left in reversed(range(_STRAIGHTENED + 1)):
        if views.lenses is not None and not left:
            views = replace(views, lenses=replace(views.lenses, straight=True))
        prediction = predict(views)
        if not prediction.bent:
            return prediction, views
        assert views.lenses is not None, "bends are sought of lenses that are known"
        before = views.lenses.straightened or (None,) * len(prediction.bent)
        told = zip(before, prediction.bent, strict=True)
        views = straighten_views(taken, [old if new is None else after(old, new) for old, new in told])
    raise AssertionError("the last round seeks no bends")


def found_views(views: Views, prediction: Prediction) -> Views:
    """The views with the lens that was found; the warning that it was assumed goes, or says what is left."""
    if prediction.Ks is not None:
        views = replace(views, Ks=prediction.Ks)
    if views.lenses is None or not views.lenses.note:
        return views
    note, settled = views.lenses.note, views.lenses.settled(prediction.lenses)
    kept = () if settled else ((f"{note}{_NOT_TOLD}",) if views.num_views > 2 else (note,))
    return replace(views, warnings=(*(w for w in views.warnings if w != note), *kept))
