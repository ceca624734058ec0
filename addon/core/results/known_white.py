"""What has a known albedo, as the command line says it: a part of the room, or a pixel of a frame."""

import re

import numpy as np

from ..errors import BadInputError
from ..kinds import Shown, Unit
from ..photo import MIDDLE_GREY
from ..scene.model import Capture
from ..scene.rays import RayScene
from .overrides import White

WHITE_PAINT: Unit[float] = 0.8
"""Albedo of white wall paint, as the panel has it."""
LISTED: Shown[int] = 6
"""Frames that are named where none is called so."""
PIXEL = re.compile(r"(?P<frame>.+):\s*(?P<x>\d+)\s*,\s*(?P<y>\d+)\s*")


def white_of(text: str, capture: Capture) -> White:
    """A known white: 'PART' or 'FRAME:X,Y', and its albedo, 'PART=ALBEDO'.

    A part is told by its name or its number; a class stands for its one object. Without an albedo it counts as painted
    white (`WHITE_PAINT`). Of a frame, told by its name or its picture's, the pixel in column X and row Y, counted from
    0 at the top left, shows the spot: without an albedo a grey card (`MIDDLE_GREY`).

    Raises
    ------
    BadInputError
        No part, frame or pixel is called that, or several are; no surface lies there; or the albedo can't be one.
    """
    what, _, told = text.partition("=")
    pixel = PIXEL.fullmatch(what)
    try:
        albedo = float(told) if told else MIDDLE_GREY if pixel else WHITE_PAINT
    except ValueError:
        albedo = 0.0
    if not 0 < albedo <= 1:
        raise BadInputError(f"Albedo '{told}' of '{what.strip()}' is no number above 0 and up to 1; give one.")
    if pixel:
        number, place = _spot(pixel["frame"].strip(), int(pixel["x"]), int(pixel["y"]), capture)
        return White(number, (albedo,) * 3, place)
    return White(_part(what.strip(), capture), (albedo,) * 3)


def _part(name: str, capture: Capture) -> int:
    wanted = name.casefold()
    whole = [one for one in capture.instances if one.name.casefold() == wanted]
    found = whole or [one for one in capture.instances if wanted in (one.class_name.casefold(), str(one.object_id))]
    if len(found) != 1:
        known = ", ".join(one.name for one in found or capture.instances)
        how = "means several parts" if found else "is no part of the capture"
        raise BadInputError(f"White '{name}' {how}; name one of {known}.")
    return found[0].object_id


def _spot(name: str, x: int, y: int, capture: Capture) -> tuple[int, tuple[float, float, float]]:
    """The object_id that a pixel shows, and where."""
    found = [one for one in capture.frames if one.name == name] or [
        one for one in capture.frames if name in (one.path.name, one.path.stem)
    ]
    if len(found) != 1:
        known = ", ".join(one.name for one in (found or capture.frames)[:LISTED])
        how = "means several frames" if found else "is no frame of the capture"
        raise BadInputError(f"'{name}' {how}; name one, such as {known or 'none, as it has none'}.")
    camera, mesh = found[0].camera, capture.mesh
    if not (x < camera.width and y < camera.height):
        raise BadInputError(
            f"Frame '{name}' has {camera.width} x {camera.height} pixels, and none at {x},{y}; count from 0."
        )
    middle = np.array([[x + 0.5, y + 0.5]])
    direction, led = camera.rays(middle)
    hits = RayScene(mesh.vertices, mesh.triangles).intersect(camera.centre[None].astype(np.float32), direction)
    if not led[0] or hits.triangle[0] < 0:
        raise BadInputError(f"At {x},{y} of frame '{name}' there is no surface; name a pixel that shows the card.")
    place = camera.centre + direction[0] * float(hits.distance[0])
    return int(mesh.object_id[hits.triangle[0]]), (float(place[0]), float(place[1]), float(place[2]))
