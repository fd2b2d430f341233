"""A second X client, by hand over libX11: drops files as a file manager does, and takes pictures.

XDND version 5: https://www.freedesktop.org/wiki/Specifications/XDND. The source announces
itself (Enter), points (Position, until the target's Status accepts), drops, and serves
`text/uri-list` when the target asks for the selection; the target ends with Finished.
"""

import ctypes
import time
from ctypes import POINTER, Structure, Union, byref, c_char_p, c_int, c_long, c_ulong, c_void_p
from ctypes.util import find_library
from pathlib import Path

import numpy as np

CLIENT_MESSAGE, SELECTION_REQUEST, SELECTION_NOTIFY = 33, 30, 31
ALL_PLANES, Z_PIXMAP = c_ulong(0xFFFFFFFF), 2


class ClientMessage(Structure):
    _fields_ = [
        ("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", c_void_p),
        ("window", c_ulong), ("message_type", c_ulong), ("format", c_int), ("l", c_long * 5),
    ]  # fmt: skip


class SelectionRequest(Structure):
    _fields_ = [
        ("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", c_void_p),
        ("owner", c_ulong), ("requestor", c_ulong), ("selection", c_ulong),
        ("target", c_ulong), ("property", c_ulong), ("time", c_ulong),
    ]  # fmt: skip


class SelectionNotify(Structure):
    _fields_ = [
        ("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", c_void_p),
        ("requestor", c_ulong), ("selection", c_ulong), ("target", c_ulong), ("property", c_ulong),
        ("time", c_ulong),
    ]  # fmt: skip


class Event(Union):
    _fields_ = [
        ("type", c_int), ("client", ClientMessage), ("request", SelectionRequest),
        ("notify", SelectionNotify), ("pad", c_long * 24),
    ]  # fmt: skip


class Image(Structure):
    """The head of XImage, as far as the pixels."""

    _fields_ = [
        ("width", c_int), ("height", c_int), ("xoffset", c_int), ("format", c_int), ("data", c_void_p),
        ("byte_order", c_int), ("bitmap_unit", c_int), ("bitmap_bit_order", c_int), ("bitmap_pad", c_int),
        ("depth", c_int), ("bytes_per_line", c_int), ("bits_per_pixel", c_int),
    ]  # fmt: skip


def _library():
    x = ctypes.CDLL(find_library("X11"))
    window, display = c_ulong, c_void_p
    x.XOpenDisplay.argtypes, x.XOpenDisplay.restype = [c_char_p], display
    x.XDefaultRootWindow.argtypes, x.XDefaultRootWindow.restype = [display], window
    x.XCreateSimpleWindow.argtypes = [display, window, *[c_int] * 2, *[ctypes.c_uint] * 3, *[c_ulong] * 2]
    x.XCreateSimpleWindow.restype = window
    x.XInternAtom.argtypes, x.XInternAtom.restype = [display, c_char_p, c_int], c_ulong
    x.XSendEvent.argtypes = [display, window, c_int, c_long, POINTER(Event)]
    x.XSetSelectionOwner.argtypes = [display, c_ulong, window, c_ulong]
    x.XChangeProperty.argtypes = [display, window, c_ulong, c_ulong, c_int, c_int, c_char_p, c_int]
    x.XNextEvent.argtypes = [display, POINTER(Event)]
    for name in ("XPending", "XFlush", "XCloseDisplay"):
        getattr(x, name).argtypes = [display]
    x.XSync.argtypes = [display, c_int]
    x.XGetImage.argtypes = [display, window, c_int, c_int, ctypes.c_uint, ctypes.c_uint, c_ulong, c_int]
    x.XGetImage.restype = POINTER(Image)
    x.XDestroyImage.argtypes = [POINTER(Image)]
    return x


class Client:
    """One connection to `display` (":5")."""

    def __init__(self, display: str) -> None:
        self._x = _library()
        self._display = self._x.XOpenDisplay(display.encode())
        assert self._display, f"no X server at {display}"
        self._root = self._x.XDefaultRootWindow(self._display)
        self._own = self._x.XCreateSimpleWindow(self._display, self._root, 0, 0, 1, 1, 0, 0, 0)

    def close(self) -> None:
        self._x.XCloseDisplay(self._display)

    def picture(self, width: int, height: int) -> np.ndarray:
        """The screen's upper left (height, width, 3) as uint8 RGB."""
        self._x.XSync(self._display, 0)
        image = self._x.XGetImage(self._display, self._root, 0, 0, width, height, ALL_PLANES, Z_PIXMAP)
        head = image.contents
        assert head.bits_per_pixel == 32
        raw = ctypes.string_at(head.data, head.bytes_per_line * height)
        self._x.XDestroyImage(image)
        rows = np.frombuffer(raw, np.uint8).reshape(height, head.bytes_per_line // 4, 4)
        return rows[:, :width, 2::-1].copy()

    def drop(self, window: int, paths: list[Path], at: tuple[int, int], patience: float = 10.0) -> None:
        """Drop files on a window at root coordinates; returns once the target has finished."""
        uris = b"".join(path.resolve().as_uri().encode() + b"\r\n" for path in paths)
        kind = self._atom("text/uri-list")
        self._x.XSetSelectionOwner(self._display, self._atom("XdndSelection"), self._own, 0)
        self._send(window, "XdndEnter", (5 << 24, kind, 0, 0))
        where = at[0] << 16 | at[1]
        self._send(window, "XdndPosition", (0, where, 0, self._atom("XdndActionCopy")))
        status = self._await("XdndStatus", uris, patience)
        assert status.client.l[1] & 1, "the window does not accept the drop"
        self._send(window, "XdndDrop", (0, 0, 0, 0))
        self._await("XdndFinished", uris, patience)

    def set_resources(self, text: str) -> None:
        """What xrdb would: the desktop's settings, for programs that start from now on."""
        manager, kind = self._atom("RESOURCE_MANAGER"), self._atom("STRING")
        content = text.encode()
        self._x.XChangeProperty(self._display, self._root, manager, kind, 8, 0, content, len(content))
        self._x.XSync(self._display, 0)

    def ask_to_close(self, window: int) -> None:
        """What a window manager's close button sends."""
        message = (c_long * 5)(self._atom("WM_DELETE_WINDOW"), 0, 0, 0, 0)
        kind = self._atom("WM_PROTOCOLS")
        client = ClientMessage(CLIENT_MESSAGE, 0, 1, self._display, window, kind, 32, message)
        self._x.XSendEvent(self._display, window, 0, 0, byref(Event(client=client)))
        self._x.XFlush(self._display)

    def _atom(self, name: str) -> int:
        return self._x.XInternAtom(self._display, name.encode(), 0)

    def _send(self, window: int, name: str, words: tuple[int, int, int, int]) -> None:
        message = (c_long * 5)(self._own, *words)
        client = ClientMessage(CLIENT_MESSAGE, 0, 1, self._display, window, self._atom(name), 32, message)
        self._x.XSendEvent(self._display, window, 0, 0, byref(Event(client=client)))
        self._x.XFlush(self._display)

    def _await(self, name: str, content: bytes, patience: float) -> Event:
        """Serve the selection until the client message `name` comes."""
        wanted, event, end = self._atom(name), Event(), time.monotonic() + patience
        while time.monotonic() < end:
            if not self._x.XPending(self._display):
                time.sleep(0.01)
                continue
            self._x.XNextEvent(self._display, byref(event))
            if event.type == CLIENT_MESSAGE and event.client.message_type == wanted:
                return event
            if event.type == SELECTION_REQUEST:
                self._serve(event.request, content)
        raise TimeoutError(f"{name} did not come")

    def _serve(self, asked: SelectionRequest, content: bytes) -> None:
        self._x.XChangeProperty(
            self._display, asked.requestor, asked.property, asked.target, 8, 0, content, len(content)
        )
        reply = SelectionNotify(
            SELECTION_NOTIFY, 0, 1, self._display, asked.requestor, asked.selection, asked.target,
            asked.property, asked.time,
        )  # fmt: skip
        self._x.XSendEvent(self._display, asked.requestor, 0, 0, byref(Event(notify=reply)))
        self._x.XFlush(self._display)
