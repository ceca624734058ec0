"""A spot of known albedo: what its whole object's mean albedo has to be for the spot to come out as known."""

from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from mathutils.interpolate import poly_3d_calc

from ...core.errors import BadInputError
from ...core.pipeline.params import CORRECTED
from ..data.mesh_objects import ATLAS_UV
from ..scene.write import ALBEDO
from . import corrections, unseen


def of_object(
    thing: bpy.types.Object, place: Vector, albedo: tuple[float, float, float], depsgraph: bpy.types.Depsgraph
) -> list[float]:
    """The mean albedo of an object one spot of which has a known one.

    Parameters
    ----------
    thing : bpy.types.Object
        `corrections.correctable`.
    place : Vector
        The spot, on its surface; world, metres.
    albedo : (3,) tuple of float
        Known, linear Rec.709.

    Raises
    ------
    BadInputError
        The object has no texture, the result is gone, the spot is black or was not measured, or the mean would
        have to be above 1.
    """
    mean = (corrections.entry(thing).get("evidence") or {}).get("albedo")
    if mean is None:
        raise BadInputError(f"The mean albedo of '{thing.name}' is not known; click on an object that was measured.")
    found = _around(thing, _uv(thing, place, depsgraph))
    if min(found) < 1e-3:
        raise BadInputError(f"That spot on '{thing.name}' is black in the result; click on a brighter one.")
    wanted = [known * whole / spot for known, whole, spot in zip(albedo, mean, found, strict=True)]
    if max(wanted) > 1:
        raise BadInputError(
            f"With that spot at {', '.join(f'{part:.2f}' for part in albedo)} the mean of "
            f"'{thing.name}' would be above 1; give a darker albedo or click on a brighter spot."
        )
    return wanted


def _around(thing, uv) -> list[float]:
    """Median of the measured albedo around a place of the atlas."""
    node = unseen.texture_node(thing)
    if node is None:
        raise BadInputError(f"Object '{thing.name}' has one colour and no albedo of its spots; click on another.")
    quality = unseen.coverage(thing)[..., 2]
    base = Path(unseen.path_of(node.image))
    path = base.with_name(base.name.replace("base_color", Path(ALBEDO).stem))
    if not path.is_file():
        raise BadInputError(f"'{path}' is missing; run the recovery again to its end.")
    from ...core.io.exr import read_exr  # not earlier: Blender's start should not wait for it

    image = np.array(read_exr(path).rgb)[::-1]
    height, width = image.shape[:2]
    column, row = (min(max(int(at * size), 0), size - 1) for at, size in zip(uv, (width, height), strict=True))
    far = int(CORRECTED.around)
    window = tuple(slice(max(at - far, 0), at + far + 1) for at in (row, column))
    measured = unseen.was_measured(quality[window])
    if not measured.any():
        raise BadInputError(f"That spot on '{thing.name}' was not measured by any frame; click on another.")
    return [float(part) for part in np.median(image[window][measured], axis=0)]


def _uv(thing, place, depsgraph):
    data = thing.data
    local = thing.matrix_world.inverted() @ place
    _, near, _, face = thing.closest_point_on_mesh(local, depsgraph=depsgraph)
    polygon = data.polygons[face] if 0 <= face < len(data.polygons) else None
    if polygon is None:
        raise BadInputError(f"'{thing.name}' was changed by a modifier there; click on another spot.")
    weights = poly_3d_calc([data.vertices[number].co for number in polygon.vertices], near)
    layer = data.uv_layers[ATLAS_UV].uv
    corners = [layer[loop].vector for loop in polygon.loop_indices]
    return [sum(weight * corner[k] for weight, corner in zip(weights, corners, strict=True)) for k in (0, 1)]
