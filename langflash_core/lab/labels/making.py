"""What makes labels of clips, as an order says: models are read once, then clip after clip."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from langflash_core.base.files import filled_atomically, write_atomically
from langflash_core.base.running import Progress
from langflash_core.batch.summary import THUMBNAIL
from langflash_core.export.colours import label_colours
from langflash_core.lab.labels.clips import Clip, ClipPlace, open_clip
from langflash_core.lab.labels.collecting import collect
from langflash_core.lab.labels.following import MotionPropagator
from langflash_core.lab.labels.motion import NetworkMotion, by_flow
from langflash_core.lab.labels.network_labels import NetworkGroups, NetworkNames
from langflash_core.lab.labels.order import LabelOrder
from langflash_core.lab.labels.prompted import PromptedSam
from langflash_core.lab.labels.protocols import ImageTextEncoder, MaskPropagator, MaskProposer
from langflash_core.lab.labels.report import Quality, as_jpeg, over, report
from langflash_core.lab.labels.storage import ClipLabels, write_labels
from langflash_core.language.vocabulary import all_phrases
from langflash_core.network import LangFlashNet, load_network
from langflash_core.network.semantics.mobile_sam.model import load_mobile_sam

REPORT = "report.html"
_THUMBNAIL = 96  # pixels high


class LabelMaker:
    """Labels clips as ordered; models are read once."""

    def __init__(self, order: LabelOrder) -> None:
        """Reads what it needs.

        Raises:
            WeightsError: weights are missing. MissingPackageError: a package is.
        """
        self._order = order
        self.proposer, self.propagator = self._models()
        self.encoder = self._encoder()

    @cached_property
    def network(self) -> LangFlashNet:
        """Our own."""
        return load_network("mini", device=self._order.device)

    def label(self, clip: Clip, progress: Progress = lambda stage, fraction: None) -> ClipLabels:
        """Collect the labels of a clip."""
        return collect(clip, self.proposer, self.propagator, self.encoder, progress=progress)

    def fill(
        self, place: ClipPlace, folder: Path, progress: Progress = lambda stage, fraction: None
    ) -> tuple[ClipLabels, Quality]:
        """Label one clip, and put labels, report and thumbnail into a folder: all of them or none.

        Raises:
            LangFlashError: the clip cannot be read, or the folder not be written.
        """
        order = self._order
        clip = open_clip(place).part(order.start, order.count, order.step)
        labels = self.label(clip, progress)
        page, measured = report(clip, labels, self.called)
        with filled_atomically(folder) as staging:
            write_labels(labels, staging)
            write_atomically(staging / REPORT, page)
            write_atomically(staging / THUMBNAIL, _thumbnail(clip, labels))
        return labels, measured

    def called(self, vectors: np.ndarray) -> Sequence[str]:
        """The phrase of the vocabulary that is nearest to each vector; nothing for a vector of zeros."""
        phrases, texts = self._vocabulary
        best = (vectors @ texts.T).argmax(1)
        known = np.linalg.norm(vectors, axis=1) > 0
        return [phrases[n] if sure else "" for n, sure in zip(best.tolist(), known.tolist(), strict=True)]

    @cached_property
    def _vocabulary(self) -> tuple[tuple[str, ...], np.ndarray]:
        phrases = all_phrases()
        return phrases, self.encoder.texts(phrases).numpy()

    def _models(self) -> tuple[MaskProposer, MaskPropagator]:
        order = self._order
        motion = NetworkMotion(self.network) if order.follow == "network" else by_flow
        if order.masks == "sam2":
            from langflash_core.lab.labels.sam2 import load_sam2

            pictures, propagator = load_sam2(order.weights, order.device)
            sam = PromptedSam(pictures)
            return sam, propagator if order.follow == "sam2" else MotionPropagator(motion, sam)
        if order.masks == "mobile-sam":
            sam = PromptedSam(load_mobile_sam(Path(order.weights), order.side, order.device))
            return sam, MotionPropagator(motion, sam)
        return NetworkGroups(self.network), MotionPropagator(motion)

    def _encoder(self) -> ImageTextEncoder:
        if self._order.vectors == "clip":
            from langflash_core.lab.labels.embedding import ClipCrops

            return ClipCrops()
        return NetworkNames(self.network)


def _thumbnail(clip: Clip, labels: ClipLabels) -> bytes:
    """The middle frame and its objects, side by side."""
    frame = len(clip) // 2
    image = clip.read(frame)
    colours = label_colours(len(labels.objects) + 1)
    both = np.concatenate([image, over(image, labels.ids[frame], colours)], 1)
    return as_jpeg(both, (max(1, round(_THUMBNAIL * both.shape[1] / both.shape[0])), _THUMBNAIL))
