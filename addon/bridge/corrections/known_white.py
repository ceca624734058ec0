"""A spot of known albedo: what its whole object's mean albedo has to be for the spot to come out as known."""

from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from mathutils.interpolate import poly_3d_calc

from ...core.errors import BadInputError
from ...core.pipeline.params import CORRECTED
from ..data.instances import chosen_in, name_of
from ..data.mesh_objects import ATLAS_UV
from ..scene.write import ALBEDO
from . import corrections, unseen


def of_object(
    obj: bpy.types.Object, location: Vector, albedo: tuple[float, float, float], depsgraph: bpy.types.Depsgraph
) -> list[float]:
    """The mean albedo of an object, or of the part of it whose material slot is active, from that of one spot.

    Parameters
    ----------
    location : Vector
        The spot, on its surface; world, metres.
    albedo : (3,) tuple of float
        Known, linear Rec.709.

    Raises
    ------
    BadInputError
        The object has no texture, the result is gone, the spot is black or was not measured, or the mean would
        have to be above 1.
    """
    mean = (corrections.entry(obj).get("evidence") or {}).get("albedo")
    if mean is None:
        raise BadInputError(f"The mean albedo of '{name_of(obj)}' is not known; click on an object that was measured.")
    local_albedo = _albedo_around(obj, _uv(obj, location, depsgraph))
    if min(local_albedo) < 1e-3:
        raise BadInputError(f"That spot on '{name_of(obj)}' is black in the result; click on a brighter one.")
    required = [known * whole / spot for known, whole, spot in zip(albedo, mean, local_albedo, strict=True)]
    if max(required) > 1:
        raise BadInputError(
            f"With that spot at {', '.join(f'{channel:.2f}' for channel in albedo)} the mean of "
            f"'{obj.name}' would be above 1; give a darker albedo or click on a brighter spot."
        )
    return required


def _albedo_around(obj, uv) -> list[float]:
    """Median of the measured albedo around a place of the atlas."""
    node = unseen.texture_node(obj, chosen_in(obj))
    if node is None:
        raise BadInputError(f"Object '{obj.name}' has one colour and no albedo of its spots; click on another.")
    quality = unseen.coverage(obj)[..., 2]
    base = Path(unseen.path_of(node.image))
    path = base.with_name(base.name.replace("base_color", Path(ALBEDO).stem))
    if not path.is_file():
        raise BadInputError(f"'{path}' is missing; run the recovery again to its end.")
    from ...core.io.exr import read_exr  # not earlier: Blender's start should not wait for it

    image = np.array(read_exr(path).rgb)[::-1]
    height, width = image.shape[:2]
    column, row = (min(max(int(at * size), 0), size - 1) for at, size in zip(uv, (width, height), strict=True))
    radius = int(CORRECTED.around)
    window = tuple(slice(max(at - radius, 0), at + radius + 1) for at in (row, column))
    measured = unseen.was_measured(quality[window])
    if not measured.any():
        raise BadInputError(f"That spot on '{obj.name}' was not measured by any frame; click on another.")
    return [float(channel) for channel in np.median(image[window][measured], axis=0)]


def _uv(obj, location, depsgraph):
    data = obj.data
    local = obj.matrix_world.inverted() @ location
    _, nearest, _, face = obj.closest_point_on_mesh(local, depsgraph=depsgraph)
    if not 0 <= face < len(data.polygons):
        raise BadInputError(f"'{obj.name}' was changed by a modifier there; click on another spot.")
    polygon = data.polygons[face]
    weights = poly_3d_calc([data.vertices[index].co for index in polygon.vertices], nearest)
    layer = data.uv_layers[ATLAS_UV].uv
    corners = [layer[loop].vector for loop in polygon.loop_indices]
    return [sum(weight * corner[k] for weight, corner in zip(weights, corners, strict=True)) for k in (0, 1)]
