"""What is known of a rendered room. H W pixels, G' its instances, V views."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import torch
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.geometry.fusion import DepthView
from langflash_core.lab.evaluation.rooms.tally import MIN_SHARE
from langflash_core.lab.evaluation.side_measures import seen_by
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.shards import RoomRecord
from langflash_core.types import Views


def opened(folder: Path, limit: int | None) -> RoomSet:
    """The rooms of one set of a cache.

    Raises:
        InputError: there are none.
    """
    try:
        return RoomSet(folder, limit=limit)
    except ValueError as error:
        raise InputError(str(error)) from None


def records(rooms: RoomSet) -> Iterator[RoomRecord]:
    """Rooms in order, without tokens."""
    for shard, index in rooms.entries:
        yield shard.record(index, with_tokens=False)


def median_depth(data: Path, scenes: int = 256) -> float:
    """Median true depth of training rooms, metres: the best constant there is."""
    if not (data / "train").is_dir():
        return 2.5
    rooms = opened(data / "train", scenes)
    samples = [record.depths[:, ::8, ::8].float().flatten() for record in records(rooms)]
    joined = torch.cat(samples)
    return float(joined[joined > 0].median())


def views_of(record: RoomRecord, chosen: Sequence[int]) -> Views:
    """Views of a stored scene as the network takes them; sources are left out, so matching reads
    the same pictures."""
    keep = list(chosen)
    return Views(
        images=record.rgb[keep].float() / 255,
        Ks=record.Ks[keep],
        names=tuple(f"view {v}" for v in keep),
    )


def relative(record: RoomRecord, view: int) -> Tensor:
    """Pose of a view, world = view 0."""
    return record.viewmats[view].double().matmul(torch.linalg.inv(record.viewmats[0].double())).float()


def group_mask(record: RoomRecord, group: str, view: int) -> Tensor:
    """Pixels (H, W) of every instance of a class group in a view."""
    own = [index for index, label in enumerate(record.labels) if label.group == group]
    return torch.isin(record.instances[view].long(), torch.tensor(own))


def visible_groups(record: RoomRecord, view: int) -> list[str]:
    """Class groups that cover at least `MIN_SHARE` of a view."""
    areas = torch.bincount(record.instances[view].long().flatten(), minlength=256).float()
    shares: dict[str, float] = {}
    for index, label in enumerate(record.labels):
        shares[label.group] = shares.get(label.group, 0.0) + float(areas[index]) / float(areas.sum())
    return sorted(group for group, share in shares.items() if share >= MIN_SHARE)


def seen_by_photos(record: RoomRecord) -> Tensor:
    """Pixels (H, W) of the target view whose surface photo 0 or 1 sees, from true depths.

    What no photo saw cannot be drawn or named by any method; it is left out of the target's
    measures, alike for all of them.
    """
    maps = (t.double().numpy() for t in (record.depths, record.viewmats, record.Ks))
    first, second, target = (DepthView(*own) for own in zip(*maps, strict=True))
    return torch.from_numpy(seen_by(target, [first, second]))


def true_masks(record: RoomRecord, views: Sequence[int]) -> Tensor:
    """One-hot instance masks (V, number of labels, H, W) of some views."""
    ids = record.instances[list(views)].long()
    return torch.stack([(ids == i).float() for i in range(len(record.labels))], 1)
