"""What has a known albedo, as the command line says it: a part of the room, or a pixel of a frame."""

import re

import numpy as np

from ..brdf.lambertian import WHITE_PAINT
from ..errors import BadInputError
from ..json_values import float_of
from ..kinds import Shown
from ..photo import MIDDLE_GREY
from ..scene.model import Capture
from ..scene.rays import RayScene
from .overrides import White

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
    subject, _, albedo_text = text.partition("=")
    pixel = PIXEL.fullmatch(subject)
    albedo = float_of(albedo_text) if albedo_text else MIDDLE_GREY if pixel else WHITE_PAINT
    if not 0 < albedo <= 1:
        raise BadInputError(
            f"Albedo '{albedo_text}' of '{subject.strip()}' is no number above 0 and up to 1; give one."
        )
    if pixel:
        object_id, place = _spot(pixel["frame"].strip(), int(pixel["x"]), int(pixel["y"]), capture)
        return White(object_id, (albedo,) * 3, place)
    return White(_part(subject.strip(), capture), (albedo,) * 3)


def _part(name: str, capture: Capture) -> int:
    wanted = name.casefold()
    whole = [instance for instance in capture.instances if instance.name.casefold() == wanted]
    matches = whole or [
        instance
        for instance in capture.instances
        if wanted in (instance.class_name.casefold(), str(instance.object_id))
    ]
    if len(matches) != 1:
        known = ", ".join(instance.name for instance in matches or capture.instances)
        problem = "means several parts" if matches else "is no part of the capture"
        raise BadInputError(f"White '{name}' {problem}; name one of {known}.")
    return matches[0].object_id


def _spot(name: str, x: int, y: int, capture: Capture) -> tuple[int, tuple[float, float, float]]:
    """The object_id that a pixel shows, and where."""
    matches = [frame for frame in capture.frames if frame.name == name] or [
        frame for frame in capture.frames if name in (frame.path.name, frame.path.stem)
    ]
    if len(matches) != 1:
        known = ", ".join(frame.name for frame in (matches or capture.frames)[:LISTED])
        problem = "means several frames" if matches else "is no frame of the capture"
        raise BadInputError(f"'{name}' {problem}; name one, such as {known or 'none, as it has none'}.")
    camera, mesh = matches[0].camera, capture.mesh
    if not (x < camera.width and y < camera.height):
        raise BadInputError(
            f"Frame '{name}' has {camera.width} x {camera.height} pixels, and none at {x},{y}; count from 0."
        )
    pixel = np.array([[x + 0.5, y + 0.5]])
    direction, defined = camera.rays(pixel)
    hits = RayScene(mesh.vertices, mesh.triangles).intersect(camera.centre[None].astype(np.float32), direction)
    if not defined[0] or hits.triangle[0] < 0:
        raise BadInputError(f"At {x},{y} of frame '{name}' there is no surface; name a pixel that shows the card.")
    point = camera.centre + direction[0] * float(hits.distance[0])
    return int(mesh.object_id[hits.triangle[0]]), (float(point[0]), float(point[1]), float(point[2]))
