"""Drags files from outside into a window, as a file manager does: the source's half of the XDND protocol, version 5.

Blender, the target, finds files by the type text/uri-list (https://freedesktop.org/wiki/Specifications/XDND).
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path

from Xlib import X, Xatom
from Xlib.display import Display
from Xlib.protocol import event

VERSION = 5
PATIENCE = 20.0
"""Seconds until the target counts as deaf."""


def drop(screen: str, window: int, files: Iterable[Path], x: int, y: int) -> None:
    """Drag files to a place of a window and let go.

    Parameters
    ----------
    screen : str
        The X display, such as ':1'.
    window : int
        The target's X window.
    files : iterable of Path
    x, y : int
        From the root window's upper left corner, in pixels.

    Raises
    ------
    RuntimeError
        The target takes no files, or does not answer.
    """
    display = Display(screen)
    try:
        _Drag(display, window, files).drop(x, y)
    finally:
        display.close()


class _Drag:
    def __init__(self, display: Display, window: int, files: Iterable[Path]):
        self._display, self._target = display, display.create_resource_object("window", window)
        self._atom = {
            name: display.intern_atom(name)
            for name in (
                "XdndAware",
                "XdndSelection",
                "XdndEnter",
                "XdndPosition",
                "XdndStatus",
                "XdndDrop",
                "XdndFinished",
                "XdndActionCopy",
                "text/uri-list",
                "TARGETS",
            )
        }
        self._data = "".join(f"{Path(one).absolute().as_uri()}\r\n" for one in files).encode()
        root = display.screen().root
        self._source = root.create_window(0, 0, 1, 1, 0, X.CopyFromParent, event_mask=X.PropertyChangeMask)

    def drop(self, x: int, y: int) -> None:
        """Enter, move twice, let go; returns once the target is done."""
        aware = self._target.get_full_property(self._atom["XdndAware"], Xatom.ATOM)
        if aware is None:
            raise RuntimeError("the window takes nothing that is dragged")
        self._source.set_selection_owner(self._atom["XdndSelection"], X.CurrentTime)
        self._send("XdndEnter", min(VERSION, aware.value[0]) << 24, self._atom["text/uri-list"], 0, 0)
        for dx in (3, 0):
            self._send("XdndPosition", 0, (x + dx) << 16 | y, X.CurrentTime, self._atom["XdndActionCopy"])
            self._until("XdndStatus")
        self._send("XdndDrop", 0, X.CurrentTime, 0, 0)
        self._until("XdndFinished")

    def _send(self, kind: str, *rest: int) -> None:
        message = event.ClientMessage(
            window=self._target, client_type=self._atom[kind], data=(32, [self._source.id, *rest])
        )
        self._target.send_event(message)
        self._display.flush()

    def _until(self, kind: str) -> None:
        """Wait for a message, and hand the list of files over meanwhile."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            if not self._display.pending_events():
                time.sleep(0.02)
                continue
            one = self._display.next_event()
            if one.type == X.SelectionRequest:
                self._answer(one)
            elif one.type == X.ClientMessage and one.client_type == self._atom[kind]:
                return
        raise RuntimeError(f"no {kind} from the window")

    def _answer(self, asked) -> None:
        place = asked.property
        if asked.target == self._atom["TARGETS"]:
            asked.requestor.change_property(place, Xatom.ATOM, 32, [self._atom["text/uri-list"]])
        elif asked.target == self._atom["text/uri-list"]:
            asked.requestor.change_property(place, asked.target, 8, self._data)
        else:
            place = X.NONE
        asked.requestor.send_event(
            event.SelectionNotify(
                time=asked.time,
                requestor=asked.requestor,
                selection=asked.selection,
                target=asked.target,
                property=place,
            )
        )
        self._display.flush()
