"""The room as a finished run knew it, in one file of the result folder: what an interface needs to show it again.

Reading it asks for neither the capture's pictures nor the stages, and takes a blink.
"""

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..brdf.material import ObjectMaterial
from ..brdf.material import from_json as material
from ..errors import BadInputError, MissingStageError
from ..io.files import json_if_sound
from ..scene.lens_json import lens_from_json, lens_to_json
from ..scene.model import Camera, Capture, Frame, Instance, Mesh, Shot
from .archive import Damaged, read_archive, write_archive

ROOM = "room.npz"
MATERIALS = "materials.json"
OPENINGS = "openings.json"
"""Lamps and windows that no frame saw, where they hang in openings of the mesh; absent where none were found."""
CAMERA = ("width", "height", "fx", "fy", "cx", "cy")
DAMAGE = (OSError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError, Damaged)
"""What reading a file raises that holds something else than it should."""


@dataclass(frozen=True)
class Room:
    """A finished run.

    Attributes
    ----------
    capture : Capture
        Its frames' pictures may be gone.
    atlas_uv : (t, 3, 2) float32
        Atlas coordinates of each triangle's corners.
    folder : Path
        The result folder.
    run : str
        The run's key, see `run_of`.
    """

    capture: Capture
    atlas_uv: np.ndarray
    materials: tuple[ObjectMaterial, ...]
    folder: Path
    run: str = ""


def run_of(folder: Path | str) -> str:
    """The key of the run that a result folder holds; '' where there is none, or it is older than such keys.

    Objects that were made by this run carry the same (`custom_properties.RUN`); the folder holds nothing about others.
    """
    return _text(folder, "run")


def layout_of(folder: Path | str) -> str:
    """The key of how a result folder's images are laid out; '' as for `run_of`."""
    return _text(folder, "layout")


def _text(folder: Path | str, name: str) -> str:
    value = json_if_sound(Path(folder) / MATERIALS).get(name)
    return value if isinstance(value, str) else ""


def objects_of(folder: Path | str) -> set[int]:
    """The objects of a folder's result, lamps that the run found by itself among them; none where there is none."""
    try:
        return {int(entry["object_id"]) for entry in json_if_sound(Path(folder) / MATERIALS).get("objects", ())}
    except DAMAGE:
        return set()


def openings_of(folder: Path | str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Corners ((q, 4, 3)) and radiance ((3,)) of each panel in `OPENINGS`; none where the file is absent or damaged."""
    try:
        panels = json.loads((Path(folder) / OPENINGS).read_text(encoding="utf-8"))["openings"]
        return [
            (np.array(panel["corners"], float).reshape(-1, 4, 3), np.array(panel["radiance"], float))
            for panel in panels
        ]
    except DAMAGE:
        return []


def write_room(folder: Path, capture: Capture, atlas_uv: np.ndarray | None = None) -> None:
    """Write `ROOM` into a folder; `atlas_uv` as in `Room`, all 0 where there is no atlas. Raises `StorageError`."""
    mesh = capture.mesh
    if atlas_uv is None:
        atlas_uv = np.zeros((len(mesh.triangles), 3, 2), np.float32)
    metadata = {
        "root": str(capture.root.absolute()),
        "format": capture.format,
        "instances": [[i.object_id, i.class_name, i.guess, i.part_of] for i in capture.instances],
        "frames": [
            [
                frame.name,
                str(frame.path.absolute()),
                [getattr(frame.camera, name) for name in CAMERA],
                lens_to_json(frame.camera.lens),
            ]
            for frame in capture.frames
        ],
        "pictures": [_picture_to_json(frame) for frame in capture.frames],
    }
    arrays = {
        "vertices": mesh.vertices,
        "triangles": mesh.triangles,
        "object_id": mesh.object_id,
        "atlas_uv": np.asarray(atlas_uv, np.float32),
        "poses": np.reshape([frame.camera.camera_to_world for frame in capture.frames], (-1, 4, 4)),
    }
    if mesh.uv is not None:
        arrays["uv"] = mesh.uv
    write_archive(folder / ROOM, arrays, metadata)


def read_room(folder: Path | str) -> Room:
    """The finished run in a result folder.

    Raises
    ------
    MissingStageError
        No run was finished there.
    BadInputError
        A file is damaged.
    """
    folder = Path(folder).absolute()
    for name in (ROOM, MATERIALS):
        if not (folder / name).is_file():
            raise MissingStageError(
                f"Folder '{folder}' holds no finished result ('{name}' is missing); run the recovery to its end first."
            )
    capture, atlas_uv = read_capture_file(folder)
    try:
        content = json.loads((folder / MATERIALS).read_text(encoding="utf-8"))
        return Room(
            capture, atlas_uv, tuple(material(entry) for entry in content["objects"]), folder, content.get("run", "")
        )
    except BadInputError as error:  # such as a reflectance model that is not there
        raise BadInputError(f"The result in '{folder}' can't be shown: {error}") from error
    except DAMAGE as error:
        raise _damaged(folder, error) from error


def read_capture_file(folder: Path | str) -> tuple[Capture, np.ndarray]:
    """The capture in `ROOM`, and its `atlas_uv`; raises `BadInputError` where the file is absent or damaged."""
    folder = Path(folder)
    try:
        metadata, arrays = read_archive(folder / ROOM)
        frames = tuple(
            Frame(name, Path(path), Camera(width, height, fx, fy, cx, cy, pose, lens_from_json(lens)))
            for (name, path, (width, height, fx, fy, cx, cy), lens), pose in zip(
                metadata["frames"], arrays["poses"], strict=True
            )
        )
        pictures = metadata.get("pictures") or [{}] * len(frames)
        frames = tuple(
            replace(frame, **_picture_from_json(picture)) for frame, picture in zip(frames, pictures, strict=True)
        )
        instances = tuple(Instance(int(number), name, *more) for number, name, *more in metadata["instances"])
        whole = all(instance.guess for instance in instances)
        mesh = Mesh(arrays["vertices"], arrays["triangles"], arrays["object_id"], arrays.get("uv"), whole=whole)
        return Capture(Path(metadata["root"]), mesh, instances, frames, format=metadata["format"]), arrays["atlas_uv"]
    except DAMAGE as error:
        raise _damaged(folder, error) from error


def _picture_to_json(frame: Frame) -> dict[str, Any]:
    """How a frame's pictures are to be read; JSON has no inf, so an archive holds null for it."""
    return {
        "mask_path": frame.mask_path and str(frame.mask_path.absolute()),
        "id_path": frame.id_path and str(frame.id_path.absolute()),
        "exposure": frame.exposure,
        "saturation": frame.saturation,
        "transfer": frame.transfer,
        "turned": frame.turned,
        "margin": frame.margin,
        "brackets": [[str(shot.path.absolute()), shot.exposure, shot.saturation] for shot in frame.brackets],
    }


def _picture_from_json(stored: dict[str, Any]) -> dict[str, Any]:
    """The fields of a `Frame` that `_picture_to_json` stores; none where it is of an older result."""
    if not stored:
        return {}

    def number(value: float | None) -> float:
        return math.inf if value is None else value

    paths = {name: stored[name] and Path(stored[name]) for name in ("mask_path", "id_path")}
    brackets = tuple(Shot(Path(path), exposure, number(value)) for path, exposure, value in stored["brackets"])
    return paths | {
        "exposure": stored["exposure"],
        "saturation": number(stored["saturation"]),
        "transfer": stored["transfer"],
        "turned": stored.get("turned", False),
        "margin": stored.get("margin", 0),
        "brackets": brackets,
    }


def root_of(folder: Path | str) -> Path | None:
    """Folder of the capture in `ROOM`, and nothing else of it; None where the file is absent or damaged."""
    try:
        return Path(read_archive(Path(folder) / ROOM, ())[0]["root"])
    except DAMAGE:
        return None


def _damaged(folder: Path, error: Exception) -> BadInputError:
    return BadInputError(
        f"The result in '{folder}' is damaged, changed or another version's ({type(error).__name__}: {error}); "
        "run the recovery again."
    )
