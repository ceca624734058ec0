"""What lamps reflect with their light off: windows and screens are dark, pieces of a surface are as the rest of it."""

import re
from dataclasses import dataclass

import numpy as np

from ...light.directions import cosine_hemisphere, sobol
from ...light.field import LightField
from ...light.params import LIGHT_FIT
from ...luminance import LUMINANCE
from ...paper.albedo import albedo
from ...scene.model import Instance
from ...scene.tangent_frame import to_world
from ...significance import LEVELS


@dataclass(frozen=True)
class UnlitParams:
    """Of `unlit`.

    Attributes
    ----------
    dark : float
        Albedo of what is dark: glass before an unlit room, or a screen. Real ones scatter a few per cent.
    dark_classes : tuple of str
        Words in a class's name that say so.
    flat : float
        Share of a lamp's surface, as the square of the cosine to its axis, that faces along it if it is flat: a pane of
        a tenth as thick as wide has .8.
    upright : float
        Radians from the horizontal, at most, of a pane's normal. Flat lamps in ceilings are mostly luminous panels.
    """

    dark: float = 0.02
    dark_classes: tuple[str, ...] = ("window", "pane", "screen", "monitor", "tv", "television", "display", "laptop")
    flat: float = 0.8
    upright: float = float(np.radians(30))


UNLIT = UnlitParams()

OUTSIDE = "Behind it there is nothing of the room, so with its light off it is dark, as a window at night: a guess."
CLASS = "With its light off it is dark, as its class is: a guess."
SURFACE = "With its light off it is as grey as the surface that it is a piece of: a guess."


def unlit(
    instance: Instance, field: LightField, irradiance: np.ndarray, measured: np.ndarray, seed: int = 0
) -> tuple[float | None, str]:
    """Albedo of a lamp with its light off, and a sentence on why; None where nothing tells.

    Parameters
    ----------
    irradiance : (n, 3) float
        E.
    measured : (n,) bool
        Elements whose albedo follows from L_d and E.
    """
    words = re.split(r"[^a-z]+", instance.class_name.casefold())
    if set(words) & set(UNLIT.dark_classes):
        return UNLIT.dark, CLASS
    if not looks_outside(instance.object_id, field, seed):
        return None, ""
    # Behind a wall that was fused from depth there is nothing either, and where panes are it mostly has holes.
    around = of_surface(instance.object_id, field, irradiance, measured) if field.mesh.whole else None
    return (UNLIT.dark, OUTSIDE) if around is None else (around, SURFACE)


def of_surface(object_id: int, field: LightField, irradiance: np.ndarray, measured: np.ndarray) -> float | None:
    """Median albedo (its luminance) of what else lies in the plane of a patch; None where too little is told.

    Wall beside a shade may be so bright that it is taken for a lamp. A halo is left around it: the whole wall counts.
    """
    atlas = field.atlas
    elements = atlas.elements_of(object_id)
    normal = atlas.normal[elements].mean(0)
    normal = normal / max(np.linalg.norm(normal), 1e-9)
    height = np.abs((atlas.position - atlas.position[elements].mean(0)) @ normal)
    near = measured & (irradiance > 0).all(1) & (atlas.object_id != object_id) & (atlas.normal @ normal > 0)
    near &= height < height[elements].max() + atlas.texel_edge
    if near.sum() < LEVELS.enough:
        return None
    return float(min(np.median(albedo(field.radiance[near] @ LUMINANCE, irradiance[near] @ LUMINANCE)), 1))


def looks_outside(object_id: int, field: LightField, seed: int = 0) -> bool:
    """Whether a lamp is an upright pane with the room on one side of it and nothing on the other."""
    mesh = field.mesh
    triangles = mesh.object_id == object_id
    normal, area = mesh.geometry[0][triangles].astype(np.float64), mesh.geometry[1][triangles]
    elements = field.atlas.elements_of(object_id)
    if not len(elements) or not area.sum():
        return False
    share, axes = np.linalg.eigh((area[:, None, None] * normal[:, :, None] * normal[:, None]).sum(0) / area.sum())
    axis = axes[:, 2]
    if share[2] < UNLIT.flat or abs(axis[2]) > np.sin(UNLIT.upright):
        return False
    along = mesh.vertices[mesh.triangles[triangles]].reshape(-1, 3) @ axis
    random = np.random.default_rng(seed)
    weight = field.atlas.area[elements].astype(np.float64)
    start = field.atlas.position[random.choice(elements, LIGHT_FIT.rays, p=weight / weight.sum())]
    local, (low, high) = cosine_hemisphere(sobol(LIGHT_FIT.rays, seed)), field.atlas.box
    leaving = []
    for side, plane in ((axis, along.max()), (-axis, -along.min())):
        # From beyond the pane's own far face.
        beyond = start + (plane - start @ side)[:, None] * side
        normals = np.broadcast_to(side.astype(np.float32), beyond.shape)
        directions = to_world(local[:, None], normals)[:, 0]
        hits = field.scene.intersect(field.scene.off_surface(beyond.astype(np.float32), normals), directions)
        hit = beyond + np.where(np.isfinite(hits.distance), hits.distance, 0)[:, None] * directions
        margin = field.scene.offset
        inside = ((hit > low - margin) & (hit < high + margin)).all(1)
        leaving.append(float(((hits.triangle < 0) | ~inside).mean()))
    # A kitchen's window has .88; its strips, and ceiling lamps, bulbs, spots and panels of six more rooms 0 to .04.
    return max(leaving) >= 0.5 > min(leaving)
