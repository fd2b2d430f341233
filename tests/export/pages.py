"""The slow twin of a page's own reader: a page's header and columns, its Gaussians, what it answers."""

import base64
import json
import zlib
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import torch

from langflash_core.export.packing import from_smallest_three
from langflash_core.export.settings import COLUMNS
from langflash_core.types import Gaussians


class _Parts(HTMLParser):
    """Titles and scripts of a page as a browser cuts it."""

    def __init__(self) -> None:
        super().__init__()
        self.scripts: list[tuple[str | None, str]] = []
        self.texts: dict[str, str] = {}
        self.addresses: list[str] = []
        self._inside: tuple[str, str | None] | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = dict(attrs)
        self._inside = (tag, named.get("id"))
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href", "action")]
        if tag == "script":
            self.scripts.append((named.get("id"), ""))

    def handle_data(self, data: str) -> None:
        if self._inside is None:
            return
        tag, name = self._inside
        if tag == "script":
            self.scripts[-1] = (name, self.scripts[-1][1] + data)
        else:
            self.texts[tag] = self.texts.get(tag, "") + data

    def handle_endtag(self, tag: str) -> None:
        self._inside = None


@dataclass(frozen=True)
class ReadPage:
    """header: of the page. columns: integers by name. scripts: what else is packed. texts: by tag.
    addresses: what it links to."""

    header: dict
    scripts: dict[str, bytes]
    columns: dict[str, np.ndarray]
    texts: dict[str, str]
    addresses: list[str]

    def gaussians(self) -> Gaussians:
        """In the scene's own world."""
        steps, turns, scales, colours = (
            np.stack([self.columns[f"{name}{axis}"] for axis in range(3)], 1)
            for name in ("mean", "turn", "scale", "colour")
        )
        low, high = np.array(self.header["lowest"]), np.array(self.header["highest"])
        logs = low + steps / 65535 * (high - low)
        means = np.sign(logs) * np.expm1(np.abs(logs))
        if "layers" in self.header:
            means = self._in_layers(means)
            colours[:, 0::2] = (colours[:, 0::2] + colours[:, 1:2]) % 256
        means = means + np.array(self.header["origin"])
        sh = np.array(self.header["colourBook"])[colours][:, None]
        if "palette" in self.columns:
            entries = np.array(self.header["harmonicsBook"])[self.columns["palette"]]
            sh = np.concatenate((sh, entries.reshape(-1, self.header["bases"], 3)[self.columns["label"]]), 1)
        fields = (
            means,
            from_smallest_three(self.columns["largest"], (turns / 255 * 2 - 1) * np.sqrt(0.5)),
            np.exp(np.array(self.header["scaleBook"]))[scales],
            self.columns["opacity"] / 255,
            sh,
        )
        return Gaussians(*(torch.from_numpy(np.asarray(values, np.float32)) for values in fields))

    def _in_layers(self, stored: np.ndarray) -> np.ndarray:
        """Places around the origin (N, 3) of layers, of which `stored` are those of no photo's picture."""
        places = np.stack([self.columns[f"place{axis}"] for axis in range(3)], 1)
        parts = []
        for layer in self.header["layers"]:
            view, count = self.header["views"][layer["view"]], layer["count"]
            if "lowest" not in layer:
                parts.append(stored[:count])
                stored = stored[count:]
                continue
            x, y, log = ((places[:count] + layer["lowest"]) / COLUMNS.place_steps).T
            places = places[count:]
            fx, fy, cx, cy = view["pinhole"]
            ahead = np.exp(log)
            seen = np.stack(((x - cx) / fx * ahead, (y - cy) / fy * ahead, ahead), 1)
            parts.append(np.array(view["eye"]) + seen @ np.array(view["turn"]))
        assert not len(places)
        return np.concatenate((*parts, stored))

    def dense_weights(self) -> np.ndarray:
        """w_ik (N, K) of the weights that were kept."""
        dense = np.zeros((self.header["count"], self.header["phrases"]["atoms"]))
        rows = np.arange(len(dense))
        place = 0
        while f"atom{place}" in self.columns:
            np.add.at(dense, (rows, self.columns[f"atom{place}"]), self.columns[f"weight{place}"])
            place += 1
        return dense / np.maximum(dense.sum(1, keepdims=True), 1)

    def numbers(self, name: str) -> np.ndarray:
        """scores (P, K), negatives (M, K) or gram (K, K)."""
        phrases = self.header["phrases"]
        signed = self.columns[name].astype(np.uint16).view(np.int16)
        return signed.reshape(-1, phrases["atoms"]) * phrases[f"{name}Unit"]

    def dictionary(self) -> np.ndarray:
        """d_k (K, C)."""
        return self.numbers("dictionary").reshape(self.header["phrases"]["atoms"], -1)


def read_page(path: Path, number: int = 0) -> ReadPage:
    """A page of `write_html`; number: of the scene in it."""
    parts = _Parts()
    parts.feed(path.read_text(encoding="utf-8"))
    scripts = dict(parts.scripts)
    header = json.loads(scripts[f"header{number or ''}"])
    own = f"payload{number or ''}"
    packed = {
        name: zlib.decompress(base64.b64decode(scripts[name], validate=True))
        for name in (own, "tower", "tokens")
        if name in scripts
    }
    payload = packed.pop(own)
    columns, start = {}, 0
    for name, count, width, differences in header["columns"]:
        planes = np.frombuffer(payload, np.uint8, count * width, start).reshape(width, count).astype(np.int64)
        start += count * width
        values = sum(plane << 8 * byte for byte, plane in enumerate(planes))
        if differences:
            if width == 2:
                values = np.where(values % 2, -((values + 1) // 2), values // 2)
            values = np.cumsum(values) % (1 << 8 * width)
        columns[name] = values
    assert start == len(payload)
    return ReadPage(header, packed, columns, parts.texts, parts.addresses)
