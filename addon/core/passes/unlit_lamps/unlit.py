"""Which lamps are dark with their light off: windows, by where they are or by their class, and screens."""

import re

import numpy as np

from ...light.directions import cosine_hemisphere, sobol
from ...light.field import LightField
from ...light.params import LIGHT_FIT
from ...scene.model import Instance
from ...scene.tangent_frame import to_world
from .params import UNLIT

OUTSIDE = "Behind it there is nothing of the room, so with its light off it is dark, as a window at night: a guess."
CLASS = "With its light off it is dark, as its class is: a guess."


def unlit(instance: Instance, field: LightField, seed: int = 0) -> tuple[float | None, str]:
    """Albedo of a lamp with its light off, and a sentence on why; None where nothing tells."""
    if looks_outside(instance.object_id, field, seed):
        return UNLIT.dark, OUTSIDE
    words = re.split(r"[^a-z]+", instance.class_name.casefold())
    return (UNLIT.dark, CLASS) if set(words) & set(UNLIT.dark_classes) else (None, "")


def looks_outside(object_id: int, field: LightField, seed: int = 0) -> bool:
    """Whether a lamp is an upright pane with the room on one side of it and nothing on the other."""
    mesh = field.mesh
    mine = mesh.object_id == object_id
    normal, area = mesh.geometry[0][mine].astype(np.float64), mesh.geometry[1][mine]
    own = field.atlas.elements_of(object_id)
    if not len(own) or not area.sum():
        return False
    share, axes = np.linalg.eigh((area[:, None, None] * normal[:, :, None] * normal[:, None]).sum(0) / area.sum())
    axis = axes[:, 2]
    if share[2] < UNLIT.flat or abs(axis[2]) > np.sin(UNLIT.upright):
        return False
    along = mesh.vertices[mesh.triangles[mine]].reshape(-1, 3) @ axis
    random = np.random.default_rng(seed)
    weight = field.atlas.area[own].astype(np.float64)
    start = field.atlas.position[random.choice(own, LIGHT_FIT.rays, p=weight / weight.sum())]
    local, (low, high) = cosine_hemisphere(sobol(LIGHT_FIT.rays, seed)), field.atlas.box
    leaving = []
    for side, plane in ((axis, along.max()), (-axis, -along.min())):
        # From beyond the pane's own far face.
        beyond = start + (plane - start @ side)[:, None] * side
        turn = np.broadcast_to(side.astype(np.float32), beyond.shape)
        directions = to_world(local[:, None], turn)[:, 0]
        hits = field.scene.intersect(field.scene.off_surface(beyond.astype(np.float32), turn), directions)
        met = beyond + np.where(np.isfinite(hits.distance), hits.distance, 0)[:, None] * directions
        margin = field.scene.offset
        inside = ((met > low - margin) & (met < high + margin)).all(1)
        leaving.append(float(((hits.triangle < 0) | ~inside).mean()))
    # A kitchen's window has .88; its strips, and ceiling lamps, bulbs, spots and panels of six more rooms 0 to .04.
    return max(leaving) >= 0.5 > min(leaving)
