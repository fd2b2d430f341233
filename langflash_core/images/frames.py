"""A film looked at once, from its begin to its end: its stills, kept where they are found again.

Memory holds one picture and, of each piece, its sharpest frame as a small grey one; the stills themselves are
files. Of a film that was looked at before nothing is decoded again.
"""

import hashlib
import json
import os
import shlex
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from langflash_core.base.files import filled_atomically, write_atomically
from langflash_core.base.resources import home_folder
from langflash_core.base.running import Progress
from langflash_core.errors import FilmError, OutputError
from langflash_core.images.film import Reader, open_film
from langflash_core.images.motion import (
    Follower,
    Look,
    Marks,
    Moved,
    from_one_place,
    look_at,
    marks_of,
    step_between,
    tiny,
    trackable,
)
from langflash_core.images.settings import CHOOSING, MOTION, PHOTO_LIMITS, STILLS
from langflash_core.images.still_names import still_name
from langflash_core.images.strip import (
    ELSEWHERE,
    FORMAT,
    INDEX,
    REPEAT,
    Still,
    Strip,
    choose,
    encode_index,
    read_strip,
)

STAGE = "film"
_EQUAL = "comes as equal pictures from the decoder, as interlaced films do"
_NO_GREY = np.zeros((1, 1), np.uint8)  # where no length is asked for


def nothing() -> None:
    """Goes on."""


def strip_of(
    path: Path,
    *,
    start: float = 0.0,
    end: float | None = None,
    every: float | None = None,
    progress: Progress = lambda _stage, _fraction: None,
    check: Callable[[], None] = nothing,
) -> Strip:
    """The stills of a film, of the cache where they are there.

    Args:
        start, end: seconds of the film that count.
        every: a still of each of so many seconds, however much moves; None: of each piece that moves.
        progress: called with `STAGE` and the share that is done.
        check: called at every picture; what it raises ends the work, and nothing is kept.

    Raises:
        FilmError: it cannot be decoded, or shows nothing that can be followed.
    """
    name = path.name
    with open_film(path):  # a film that cannot be read has no place in the cache
        stamp = path.stat()
    order = [
        FORMAT,
        name,
        stamp.st_size,
        stamp.st_mtime_ns,
        start,
        end,
        every,
        STILLS.piece,
        STILLS.still_side,
    ]
    films = home_folder() / "films"
    folder = films / hashlib.sha256(json.dumps(order).encode()).hexdigest()[:16]
    kept = read_strip(folder)
    if kept is not None:
        with suppress(OSError):
            os.utime(folder)
        return kept
    with filled_atomically(folder) as filling, open_film(path) as reader:
        watched = _Watch(filling, reader, every, end)
        strip = watched.strip(start, end, progress, check)
        write_atomically(filling / INDEX, encode_index(strip))
    _sweep(films, folder)
    return replace(strip, folder=folder)


def frames(
    film: Path | str, *, most: int = PHOTO_LIMITS.max_photos, start: float = 0.0, end: float | None = None
) -> list[Path]:
    """The sharpest frames of a film as photo files, for `reconstruct`; they stay in the cache for a while.

    Args:
        most: at most so many, spaced by how far the picture moves. start, end: seconds that count.

    Raises:
        FilmError: it cannot be decoded, or shows nothing that a scene can be made of.
    """
    strip = strip_of(Path(film), start=start, end=end)
    return [strip.path(index) for index in choose(strip, most).chosen]


def _sweep(films: Path, newest: Path) -> None:
    """Only the films that were used last stay."""
    with suppress(OSError):
        others = [
            each for each in films.iterdir() if each.is_dir() and each != newest and each.name[0] != "."
        ]
        for each in sorted(others, key=lambda folder: folder.stat().st_mtime)[: -STILLS.kept_films + 1]:
            shutil.rmtree(each, ignore_errors=True)


def remaining(fraction: float, began: float, now: float | None = None) -> str:
    """`, 12 s left` once that can be told. began: by `time.monotonic`."""
    gone = (time.monotonic() if now is None else now) - began
    if fraction < 0.05 or gone < 1.0:
        return ""
    return f", {gone * (1 - fraction) / fraction:.0f} s left"


@dataclass
class _Piece:
    """Of a shot: its frames so far, and the sharpest of them. judged: sharpness and rise of each."""

    shot: int
    begin: float  # seconds
    sharpest: Look
    picture: np.ndarray
    seconds: float
    place: float
    judged: list[tuple[float, float]]


class _Watch:
    """One way through a film."""

    def __init__(self, folder: Path, reader: Reader, every: float | None, end: float | None) -> None:
        self._folder, self._reader, self._every = folder, reader, every
        self._follower = Follower()
        self._piece: _Piece | None = None
        self._stills: list[Still] = []
        self._greys: list[np.ndarray] = []
        self._shots: list[int] = []  # of each still
        self._judged: list[list[tuple[float, float]]] = []  # frames that each still stands for
        self._rises: list[float] = []  # of each still
        self._base = 0.0  # how far the film had moved at the anchor
        self._carried = 0.0  # how far the piece had moved at the anchor
        self._pace = self._at = 0.0  # of the last two pictures, and where the last one is
        self._length = STILLS.piece
        self._shot = -1
        self._following = False
        self._lost = self._dark = self._plain = self._looked = 0
        self._longest = max(reader.film.seconds, end or 0.0)

    def strip(self, start: float, end: float | None, progress: Progress, check: Callable[[], None]) -> Strip:
        """Look at the whole film.

        Raises:
            FilmError: it shows nothing that can be followed.
        """
        film, first, last = self._reader.film, None, 0.0
        whole = min(end or film.seconds, film.seconds or float("inf")) - start
        for seconds, picture in self._reader.pictures(start, end, check):
            first = seconds if first is None else first
            last = seconds
            self._see(seconds, picture)
            progress(STAGE, min(max((seconds - start) / whole, 0.0), 1.0) if whole > 0 else 0.0)
        self._close()
        self._check(film.name, film.seconds, start, end)
        self._find_blurred()
        self._find_repeats(check)
        shots = self._join_shots(check)
        kept = sum(still.looks for still in self._stills if still.why_not != ELSEWHERE)
        if self._lost > self._looked / 2 and kept < self._looked / 4:
            raise _bare(film.name)
        until = film.seconds if end is None else min(end, film.seconds)  # 0: the film does not say
        shown = (last - (first or 0.0)) / max(self._looked - 1, 1)  # seconds of a picture, the last one's too
        early = bool(until) and last + shown < 0.9 * until - 0.5
        return Strip(
            film.name,
            self._folder,
            round(last - (first or 0.0) if early or not until else until - start, 3),
            tuple(self._stills),
            dark=self._dark,
            plain=self._plain,
            shots=shots,
            every=self._every,
            notes=self._notes(film.name, until if early else 0.0, last, shots),
        )

    def _see(self, seconds: float, picture: np.ndarray) -> None:
        look = look_at(picture)
        self._looked += 1
        if look.light < STILLS.dark:
            self._dark += 1
            return
        moved = self._follower.follow(look.grey) if self._following else None
        if moved is None:
            if not trackable(look.grey):
                self._plain += 1
                return
            self._close()
            step = self._wide_step(look)
            self._lost += self._following and step is None
            self._base += CHOOSING.spacing if step is None else step
            self._pace, self._at = self._pace if step is None else step, self._base
            self._shot += step is None
            self._following = self._follower.anchor(look.grey)
            self._begin(look, picture, seconds, self._base)
            return
        place = self._base + moved.since_anchor
        self._pace, self._at = abs(place - self._at), place
        if self._is_over(self._carried + moved.since_mark, seconds):
            self._close()
            self._begin(look, picture, seconds, place)
            self._follower.mark()
            moved = Moved(moved.since_anchor, 0.0)
        else:
            self._judge(look, picture, seconds, place)
        weak = self._follower.weak
        if weak or moved.since_anchor >= STILLS.ruler:
            anchored = self._follower.anchor(look.grey)
            if anchored or weak:
                self._base, self._carried = place, self._carried + moved.since_mark
            self._following = anchored or not weak

    def _wide_step(self, look: Look) -> float | None:
        """How far a picture that cannot be followed is from the last one, where both show one room; so they
        do where the film was fast just before."""
        last = self._follower.last
        if not self._following or last is None or last.shape != look.grey.shape:
            return None
        step = step_between(marks_of(last), marks_of(look.grey), last)
        if step is None:
            return STILLS.unseen if self._pace > STILLS.fast else None
        return max(step, STILLS.piece)

    def _is_over(self, gone: float, seconds: float) -> bool:
        """Whether the piece ends before the picture at hand."""
        if self._every is not None:
            return self._piece is not None and seconds - self._piece.begin >= self._every - 1e-6
        return gone >= self._length

    def _begin(self, look: Look, picture: np.ndarray, seconds: float, place: float) -> None:
        self._carried = 0.0
        self._piece = _Piece(
            self._shot, seconds, look, picture, seconds, place, [(look.sharpness, look.rise)]
        )

    def _judge(self, look: Look, picture: np.ndarray, seconds: float, place: float) -> None:
        piece = self._piece
        if piece is None:
            self._begin(look, picture, seconds, place)
            return
        piece.judged.append((look.sharpness, look.rise))
        if look.sharpness > piece.sharpest.sharpness:
            piece.sharpest, piece.picture, piece.seconds, piece.place = look, picture, seconds, place

    def _close(self) -> None:
        """Keep the sharpest frame of the piece."""
        piece, self._piece = self._piece, None
        if piece is None:
            return
        name = still_name(self._reader.film.name, piece.seconds, self._longest)
        write_picture(self._folder / name, piece.picture)
        # Places never fall back where the hand does: what is there has been seen.
        place = max(piece.place, self._stills[-1].place if self._stills else 0.0)
        sharpness = piece.sharpest.sharpness
        self._stills.append(Still(name, round(piece.seconds, 3), sharpness, place, len(piece.judged)))
        self._judged.append(piece.judged)
        self._rises.append(piece.sharpest.rise)
        self._greys.append(piece.sharpest.grey)
        self._shots.append(piece.shot)
        if len(self._stills) > STILLS.most_stills:
            self._thin()

    def _thin(self) -> None:
        """Of two stills side by side the sharper one stays, and pieces are twice as long from here on."""
        self._length *= 2
        kept: list[int] = []
        place = 0
        while place < len(self._stills):
            pair = [place]
            if place + 1 < len(self._stills) and self._shots[place] == self._shots[place + 1]:
                pair.append(place + 1)
            best = max(pair, key=lambda index: self._stills[index].sharpness)
            judged = [each for index in pair for each in self._judged[index]]
            self._stills[best] = replace(self._stills[best], looks=len(judged))
            self._judged[best] = judged
            for index in pair:
                if index != best:
                    (self._folder / self._stills[index].file).unlink(missing_ok=True)
            kept.append(best)
            place += len(pair)
        self._stills, self._greys = [self._stills[i] for i in kept], [self._greys[i] for i in kept]
        self._shots, self._rises = [self._shots[i] for i in kept], [self._rises[i] for i in kept]
        self._judged = [self._judged[i] for i in kept]

    def _find_blurred(self) -> None:
        """Compare the rise of edges with what is usual in this film, whatever it shows."""
        rises = [rise for judged in self._judged for _, rise in judged if rise > 0]
        usual = float(np.percentile(rises, 25)) if rises else 1.0
        for index, (still, judged) in enumerate(zip(self._stills, self._judged, strict=True)):
            blurred = sum(
                sharpness < CHOOSING.blurred * still.sharpness or rise > CHOOSING.smeared * usual
                for sharpness, rise in judged
            )
            smear = round(self._rises[index] / usual, 3)
            self._stills[index] = replace(still, blurred=int(blurred), smear=smear)

    def _check(self, name: str, seconds: float, start: float, end: float | None) -> None:
        """Raises:
        FilmError: nothing was seen, or nothing that can be followed.
        """
        whole = start <= 0 and (end is None or 0 < seconds <= end)
        if (self._looked == 1 and not whole) or (not self._looked and 0 < start < seconds):
            part = f"from {start:g} s on" if end is None else f"from {start:g} to {end:g} s"
            seen = "one picture only" if self._looked else "no picture"
            raise FilmError(f"{name} shows {seen} {part}; take a longer part with --from and --to")
        if not self._looked:
            if start > 0:
                raise FilmError(f"{name} shows nothing from {start:g} s on; it is {seconds:.1f} s long")
            raise FilmError(
                f"{name} holds no picture that can be decoded; copy it again or convert it to H.264"
            )
        if self._looked == 1:
            raise FilmError(f"{name} is a single picture; film for some seconds, or use photos")
        if self._reader.doubtful > self._looked / 2:
            raise FilmError(f"{name} {_EQUAL}; {_apart(name)}")
        if self._dark > self._looked / 2 and len(self._stills) < 2:
            raise FilmError(f"{name} is too dark to see anything; film again with more light")
        if not self._stills or self._plain > 0.9 * self._looked:
            raise _bare(name)

    def _find_repeats(self, check: Callable[[], None]) -> None:
        """Mark stills that show again, from the same place, what another one shows; the sharper one stays."""
        if self._every is not None:
            return
        vectors = np.stack([tiny(grey) for grey in self._greys])
        alike = vectors @ vectors.T
        for later in range(1, len(self._stills)):
            check()
            here = self._stills[later]
            for earlier in np.flatnonzero(alike[later, :later] > MOTION.alike):
                there = self._stills[earlier]
                if there.why_not or here.place - there.place < CHOOSING.spacing:
                    continue
                if from_one_place(self._greys[earlier], self._greys[later]):
                    worse = later if here.sharpness <= 1.5 * there.sharpness else int(earlier)
                    self._stills[worse] = replace(self._stills[worse], why_not=REPEAT)
                    if worse == later:
                        break

    def _join_shots(self, check: Callable[[], None]) -> int:
        """Shots that show the same room stay together, of others the longest alone; how many there were."""
        members: dict[int, list[int]] = {}
        for index, shot in enumerate(self._shots):
            members.setdefault(shot, []).append(index)
        if len(members) == 1:
            return 1
        size = {shot: self._looks(of) for shot, of in members.items()}
        largest = sorted(size, key=lambda shot: (-size[shot], shot))[: STILLS.most_shots]
        group = {shot: shot for shot in members}
        marks = {index: marks_of(self._greys[index]) for shot in largest for index in _some(members[shot])}
        for place, one in enumerate(largest):
            for other in largest[:place]:
                check()
                if group[one] != group[other] and _share_a_room(marks, members[one], members[other]):
                    was, now = group[one], group[other]
                    group = {shot: now if of == was else of for shot, of in group.items()}
        groups: dict[int, int] = {}
        for shot, of in group.items():
            groups[of] = groups.get(of, 0) + size[shot]
        stays = min(groups, key=lambda of: (-groups[of], of))
        for index, shot in enumerate(self._shots):
            if group[shot] != stays:
                self._stills[index] = replace(self._stills[index], why_not=ELSEWHERE)
        return len(groups)

    def _looks(self, indices: list[int]) -> int:
        return sum(self._stills[index].looks for index in indices)

    def _notes(self, name: str, missed: float, last: float, shots: int) -> tuple[str, ...]:
        """missed: the second up to which it was to be looked at, where it ended early."""
        notes = []
        if missed:
            notes.append(
                f"{name} ends after {last:.1f} of {missed:.1f} seconds, what follows cannot be decoded; "
                "copy the film again"
            )
        if self._reader.doubtful:
            part = f"{self._reader.doubtful / self._looked:.0%}"
            notes.append(f"{part} of {name} {_EQUAL}; {_apart(name)}")
        if shots > 1:
            kept = [still for still in self._stills if still.why_not != ELSEWHERE]
            notes.append(
                f"{name} shows {shots} places one after the other; frames of the longest are taken, "
                f"{kept[0].seconds:.1f} to {kept[-1].seconds:.1f} s; --from and --to tell another"
            )
        return tuple(notes)


def _apart(name: str) -> str:
    """How to get a film read that OpenCV does not decode."""
    return (
        "pip install 'langflash[video]' brings a decoder for it, or convert it first: "
        f"ffmpeg -i {shlex.quote(name)} -vf yadif converted.mp4"
    )


def _bare(name: str) -> FilmError:
    return FilmError(
        f"{name} shows nothing that can be followed, as a bare wall does; "
        "film a part of the room with things in it"
    )


def _share_a_room(marks: dict[int, Marks], one: list[int], other: list[int]) -> bool:
    """Whether some stills of two shots show something in common; ends that may follow each other first."""
    pairs = [(a, b) for a in _some(one) for b in _some(other)]
    pairs.sort(key=lambda pair: abs(pair[0] - pair[1]))
    return any(step_between(marks[a], marks[b], _NO_GREY) is not None for a, b in pairs)


def _some(indices: list[int]) -> list[int]:
    """Some of them, ends included."""
    places = np.unique(np.round(np.linspace(0, len(indices) - 1, STILLS.compared_stills)).astype(int))
    return [indices[place] for place in places]


def write_picture(path: Path, picture: np.ndarray) -> None:
    """A frame as JPEG.

    Raises:
        OutputError: it cannot be written.
    """
    import cv2

    height, width = picture.shape[:2]
    ratio = STILLS.still_side / max(height, width)
    if ratio < 1:
        size = max(1, round(width * ratio)), max(1, round(height * ratio))
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    done, content = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, STILLS.quality])
    if not done:
        raise OutputError(f"cannot write {path}: the frame could not be encoded; choose another film")
    try:
        path.write_bytes(content.tobytes())
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(
            f"cannot keep frames in {path.parent}: {reason}; LANGFLASH_HOME names another folder"
        ) from error
