"""Tiny data sets in the layouts that their publishers chose, made of the painted wall of `real_photos`."""

import csv
import io
import json
from pathlib import Path

import numpy as np
import torch
from PIL import Image

from langflash_core.lab.photos import PhotoFolder
from tests.lab.evaluation.real_photos import FOCAL, HEIGHT, NAMES, WIDTH, write_folder

CLASS_OF = {"desk": "desk", "garbage bin": "garbagebin"}
K = np.array([[FOCAL, 0, WIDTH / 2], [0, FOCAL, HEIGHT / 2], [0, 0, 1.0]])


def wall(root: Path, count: int) -> PhotoFolder:
    """Photos of the wall, in our own format, to be written otherwise."""
    return write_folder(root, count)


def pose_of(folder: PhotoFolder, id: str) -> np.ndarray:
    assert folder.poses is not None
    return folder.poses[id].numpy()


def scannet_table(root: Path) -> None:
    """Names by ids ten times as large as ours."""
    root.mkdir(parents=True, exist_ok=True)
    with (root / "scannetv2-labels.combined.tsv").open("w", newline="") as stream:
        writer = csv.writer(stream, delimiter="\t")
        writer.writerow(["id", "raw_category", "category", "nyu40class"])
        for id, name in NAMES.items():
            writer.writerow([10 * id, name, name, CLASS_OF.get(name, name)])


def lsm_scene(folder: PhotoFolder, root: Path) -> None:
    """images/N.jpg with N.npz beside, depths and labels, as the test set of LSM."""
    for kind in ("images", "depths", "labels"):
        (root / kind).mkdir(parents=True)
    for place, id in enumerate(folder.ids):
        number = str(place * 20)
        photo = folder.photo(id)
        assert photo.labels is not None and photo.depths is not None
        Image.fromarray(photo.image).save(root / "images" / f"{number}.jpg", quality=95)
        np.savez(root / "images" / f"{number}.npz", camera_intrinsics=K, camera_pose=pose_of(folder, id))
        Image.fromarray((photo.labels * 10).astype(np.uint16)).save(root / "labels" / f"{number}.png")
        steps = (photo.depths * 1000).round().astype(np.uint16)
        Image.fromarray(steps).save(root / "depths" / f"{number}.png")


def extracted_scene(folder: PhotoFolder, root: Path) -> None:
    """color, depth at half the size, pose, intrinsic, label-filt, as ScanNet's reader extracts a scene."""
    for kind in ("color", "depth", "pose", "intrinsic", "label-filt"):
        (root / kind).mkdir(parents=True)
    whole = np.eye(4)
    whole[:3, :3] = K
    np.savetxt(root / "intrinsic" / "intrinsic_color.txt", whole)
    for place, id in enumerate(folder.ids):
        photo = folder.photo(id)
        assert photo.labels is not None and photo.depths is not None
        Image.fromarray(photo.image).save(root / "color" / f"{place}.jpg", quality=95)
        pose = pose_of(folder, id) if place != 2 else np.full((4, 4), -np.inf)
        np.savetxt(root / "pose" / f"{place}.txt", pose)
        Image.fromarray((photo.labels * 10).astype(np.uint16)).save(root / "label-filt" / f"{place}.png")
        steps = (photo.depths[::2, ::2] * 1000).round().astype(np.uint16)
        Image.fromarray(steps).save(root / "depth" / f"{place}.png")


def jpeg(image: np.ndarray) -> torch.Tensor:
    stream = io.BytesIO()
    Image.fromarray(image).save(stream, "JPEG", quality=95)
    return torch.frombuffer(bytearray(stream.getvalue()), dtype=torch.uint8)


def cameras(folder: PhotoFolder) -> torch.Tensor:
    """(V, 18) as RealEstate10K has them: fx, fy, cx, cy in widths and heights, 0, 0, world to camera."""
    rows = []
    for id in folder.ids:
        viewmat = np.linalg.inv(pose_of(folder, id))[:3].ravel()
        rows.append([FOCAL / WIDTH, FOCAL / HEIGHT, 0.5, 0.5, 0, 0, *viewmat])
    return torch.tensor(rows, dtype=torch.float32)


def re10k_split(folder: PhotoFolder, root: Path) -> None:
    """test/index.json, one chunk of two scenes, and the evaluation index of one of them."""
    (root / "test").mkdir(parents=True)
    images = [jpeg(folder.photo(id).image) for id in folder.ids]
    chunk = [
        {
            "key": key,
            "url": "",
            "timestamps": torch.arange(len(images)),
            "cameras": cameras(folder),
            "images": images,
        }
        for key in ("aaaa", "bbbb")
    ]
    torch.save(chunk, root / "test" / "000000.torch")
    index = {"aaaa": "000000.torch", "bbbb": "000000.torch"}
    (root / "test" / "index.json").write_text(json.dumps(index))
    chosen = {
        "bbbb": {"context": [0, 4], "target": [1, 2, 3]},
        "aaaa": None,
        "cccc": {"context": [0], "target": []},
    }
    (root / "evaluation_index_re10k.json").write_text(json.dumps(chosen))


def masked_scene(folder: PhotoFolder, root: Path, *, with_cameras: bool = False) -> None:
    """images/, segmentations/classes.txt and masks of the first and the fourth photo, as 3D-OVS."""
    (root / "images").mkdir(parents=True)
    for place, id in enumerate(folder.ids):
        Image.fromarray(folder.photo(id).image).save(root / "images" / f"{place:02d}.jpg", quality=95)
    (root / "segmentations").mkdir()
    (root / "segmentations" / "classes.txt").write_text("\n".join(["wall", "floor", "chair", "desk"]) + "\n")
    for place in (0, 3):
        out = root / "segmentations" / f"{place:02d}"
        out.mkdir()
        labels = folder.labels(folder.ids[place])
        for number, name in NAMES.items():
            if name in ("wall", "floor", "chair", "desk"):
                Image.fromarray(((labels == number) * 255).astype(np.uint8)).save(out / f"{name}.png")
    if with_cameras:
        torch.save(cameras(folder), root / "cameras.pt")


def frames(folder: PhotoFolder, root: Path) -> None:
    """frame-N.color.png, .depth.png, .pose.txt, as 7-Scenes; the last pose is not finite."""
    root.mkdir(parents=True)
    for place, id in enumerate(folder.ids):
        stem = f"frame-{place:06d}"
        photo = folder.photo(id)
        assert photo.depths is not None
        Image.fromarray(photo.image).save(root / f"{stem}.color.png")
        steps = (photo.depths * 1000).round().astype(np.uint16)
        steps[0] = 65535
        Image.fromarray(steps).save(root / f"{stem}.depth.png")
        last = place == len(folder.ids) - 1
        np.savetxt(root / f"{stem}.pose.txt", np.full((4, 4), np.nan) if last else pose_of(folder, id))


VECTOR = 512  # channels of a collected thing's vector


def collect(folder: PhotoFolder, chunk: Path, keys: tuple[str, ...], offset: int = 0) -> None:
    """Put labels into videos of a chunk, as `lab labels` does: an id map a frame, a vector a thing."""
    entries = torch.load(chunk, weights_only=True)
    maps = []
    for id in folder.ids:
        labels = folder.labels(id)
        stream = io.BytesIO()
        Image.fromarray(np.where(labels > 0, labels + offset, 0).astype(np.uint16)).save(stream, "PNG")
        maps.append(torch.frombuffer(bytearray(stream.getvalue()), dtype=torch.uint8))
    draw = torch.Generator().manual_seed(0)
    vectors = torch.randn(max(NAMES) + offset, VECTOR, generator=draw)
    vectors = (vectors / vectors.norm(dim=1, keepdim=True)).half()
    for entry in entries:
        if entry["key"] in keys:
            entry["labels"] = {"format": "langflash-labels-1", "ids": maps, "vectors": vectors}
    torch.save(entries, chunk)
