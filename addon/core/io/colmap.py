"""Captures as COLMAP leaves them: a sparse model, the pictures beside it, a mesh of the dense workspace.

COLMAP's world has no up and, unless it was given measures, no metres; it is taken as it is.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import BadInputError
from ..kinds import Limit
from ..scene.lenses_colmap import intrinsics
from ..scene.model import Camera, Frame
from ..scene.pose import MAX_DISTANCE, check_pose, rotation_of
from .colmap_model import ColmapImage, ColmapModel, model_files, read_model
from .files import inside
from .formats import FORMATS
from .layout import Layout, RawMesh, Reader, Reading, usable
from .meshes import MESH, find_mesh, mesh_files, read_mesh

MODELS = ("", "sparse/0", "sparse", "colmap/sparse/0", "colmap/sparse", "colmap/0", "colmap", "dense/sparse")
"""Where in a capture a model may lie."""
PICTURES = "images"
MASKS = "masks"
HDR = (".exr", ".hdr")
"""Tried before a picture's own ending: COLMAP is often run on tone-mapped copies."""
MESHES = (MESH, "dense/meshed-poisson.ply", "dense/meshed-delaunay.ply", "dense/0/meshed-poisson.ply",
          "dense/0/meshed-delaunay.ply", "meshed-poisson.ply", "meshed-delaunay.ply")  # fmt: skip
POINTS = ("fused.ply", "dense/fused.ply", "dense/0/fused.ply", "sparse.ply", "points3D.ply")
"""Clouds of points, which are no mesh."""
UP = (
    "COLMAP's world has no up of its own; +Z was taken as up and a unit as a metre. Align the model "
    "(colmap model_aligner) if the room lies on its side, or name the axis that points up (--convention up:-y)."
)
MAX_SIZE: Limit[int] = 2**17


def find_model(root: Path) -> Path | None:
    """The folder of the model in the capture `root`, or None."""
    return next((root / place for place in MODELS if model_files(root / place)), None)


def read(root: Path, reading: Reading) -> Layout:
    """Read the model and the mesh, as `layout.Reader` has it."""
    folder = find_model(root)
    if folder is None:
        raise BadInputError(
            f"Folder '{root}' holds no COLMAP model; it needs cameras and images (.bin or .txt), there "
            "or in 'sparse', 'sparse/0' or 'colmap'."
        )
    model = read_model(folder)
    mesh = _mesh(root, reading)
    frames, problems, notes = frames_of(model, root, _pictures(root, folder), reading)
    others = [path.name for path in sorted(folder.parent.iterdir())
              if path != folder and folder.name == "0" and model_files(path)]  # fmt: skip
    if others:
        notes.append(
            f"COLMAP left {len(others) + 1} models that don't hang together; '{folder}' was read, not "
            f"{', '.join(others[:3])}."
        )
    return Layout(frames, mesh, problems=problems, notes=[*notes, UP])


def frames_of(
    model: ColmapModel, root: Path, folder: Path, reading: Reading
) -> tuple[list[Frame], list[str], list[str]]:
    """Frames of a model whose pictures lie in `folder`, sentences on those that can't be used, and notes.

    In the pictures' order by name, as COLMAP's own are in no order. A model without images raises `BadInputError`.
    """
    if not model.images:
        raise BadInputError(f"'{model.images_file}' lists no images; export the model again.")
    cameras, wrong = _cameras(model)
    seen: set[str] = set()

    def frame(image: ColmapImage) -> Frame:
        name = image.name.encode("utf-8", "replace").decode()
        if image.name in seen:
            raise BadInputError(f"Frame '{name}' is listed twice in '{model.images_file}'; keep one of the two.")
        if image.camera in wrong:
            raise BadInputError(
                f"Frame '{name}' has camera {image.camera}, which can't be used: "
                f"{wrong[image.camera]}; mend '{model.cameras_file}'."
            )
        if image.camera not in cameras:
            raise BadInputError(
                f"Frame '{name}' has camera {image.camera}, which '{model.cameras_file}' does not "
                "list; export cameras and images together."
            )
        made = _frame(image, name, cameras[image.camera], root, folder, reading)
        seen.add(image.name)
        return made

    frames, problems = usable(frame, sorted(model.images, key=lambda image: image.name))
    return frames, problems, _notes(model, frames)


def camera_to_world(image: ColmapImage, name: str) -> np.ndarray:
    """The image's pose in OpenGL axes, (4, 4) float64.

    Raises `BadInputError` where it is not finite, has no direction, or lies too far off.
    """
    finite = all(map(math.isfinite, (*image.quaternion, *image.translation)))
    if not finite or not math.hypot(*image.quaternion) > 1e-9:
        raise BadInputError(
            f"Frame '{name}' has a pose that is not finite or whose quaternion is 0; export the model again."
        )
    rotation = rotation_of(np.array(image.quaternion))
    pose = np.eye(4)
    pose[:3, :3] = rotation.T * (1, -1, -1)
    if np.abs(image.translation).max() > 10 * MAX_DISTANCE:
        raise BadInputError(f"Frame '{name}' lies over {MAX_DISTANCE:g} m from the origin; check the model's units.")
    pose[:3, 3] = -rotation.T @ image.translation
    return check_pose(pose, name)


def _cameras(model: ColmapModel) -> tuple[dict[int, Camera], dict[int, str]]:
    """Each camera, without a pose, and what is wrong with the others."""
    good, wrong = {}, {}
    for number, (name, width, height, parameters) in model.cameras.items():
        try:
            if not (0 < width <= MAX_SIZE and 0 < height <= MAX_SIZE):
                raise BadInputError(f"its size is {width} x {height}")
            fx, fy, cx, cy, lens = intrinsics(name, parameters, width, height)
            good[number] = Camera(width, height, fx, fy, cx, cy, np.eye(4), lens)
        except BadInputError as error:
            wrong[number] = str(error)
    return good, wrong


def _frame(image: ColmapImage, name: str, camera: Camera, root: Path, folder: Path, reading: Reading) -> Frame:
    named = inside(root, image.name, name, reading.outside, folder)
    camera = replace(camera, camera_to_world=camera_to_world(image, name))
    path = next((hdr for hdr in map(named.with_suffix, HDR) if hdr.is_file()), named)
    masks = []
    if named.is_relative_to(folder):
        mask = folder.parent / MASKS / named.relative_to(folder)
        # COLMAP's own convention: the picture's whole name, and .png after it.
        masks = [mask.with_name(f"{mask.name}.png"), mask.with_suffix(".png")]
    return Frame(name, path, camera, next(filter(Path.is_file, masks), None))


def _notes(model: ColmapModel, frames: list[Frame]) -> list[str]:
    numbers = {image.number for image in model.images}
    gaps = [n for n in range(1, min(max(numbers), 10 * len(numbers)) + 1) if n not in numbers]
    notes = []
    if gaps:
        few = ", ".join(map(str, gaps[:5])) + (", ..." if len(gaps) > 5 else "")
        notes.append(
            f"'{model.images_file}' has no pose for {len(gaps)} of {len(gaps) + len(numbers)} pictures "
            f"(numbers {few}): COLMAP could not place them, or they were taken out."
        )
    return notes


def _pictures(root: Path, model: Path) -> Path:
    """The folder that the images' names are relative to."""
    around = [root, *(p for p in (model, *model.parents) if p.is_relative_to(root) and p != root)]
    return next((p / PICTURES for p in around if (p / PICTURES).is_dir()), root)


def _mesh(root: Path, reading: Reading) -> RawMesh:
    cloud = next((place for place in POINTS if (root / place).is_file()), None)
    others = any(path.name not in POINTS for path in mesh_files(root))
    if reading.mesh is None and cloud and not any((root / place).exists() for place in MESHES) and not others:
        raise BadInputError(
            f"Capture '{root}' has no mesh, only the points of '{cloud}'; mesh them (colmap "
            f"poisson_mesher) to '{MESHES[1]}' or name a mesh with --mesh."
        )
    return read_mesh(find_mesh(root, reading, MESHES), reading)


READER = Reader("colmap", FORMATS["colmap"], lambda root: find_model(root) is not None, read)
