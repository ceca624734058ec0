"""Light probes for EEVEE: the room's indirect light baked into a volume, so that a preview comes nearer to the picture.

EEVEE knows of no light that bounces between surfaces, nor of what shines and is no lamp, unless it is baked. The bake
alone leaves some rooms two stops too dark, so the volume's intensity is then fitted to small pictures by Cycles (see
docs/relighting.md). The volume goes beyond the walls, whose light it else mixes with the world's, and, where a world
shines in, the walls' backs count as such.
"""

import math
import tempfile
from contextlib import suppress
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...core.errors import BadInputError, ScanRelightError
from ..data.added import own_collection, remove_own
from ..data.cameras import frame_cameras
from ..light.room import bounds, room_objects
from ..refused import reason_of
from .pictures import CYCLES, EEVEE, prepare, settings_kept, shoot, small_median

COLLECTION = "Preview Light"
PROBE = "scan_relight_probe"
"""Custom property of the probes that were made here."""
_NO_CARD = "EEVEE has no graphics card to bake the preview's light on here; use a Blender with a window, or Cycles."
_STEP, _MOST = 0.3, 24
"""Metres between two places where the light is kept, and how many of them a side has at most."""
_VIEWS = 4
"""Cameras through which the baked light is compared with Cycles: the active one and some of the capture's."""
_LEAST, _GREATEST = 0.05, 20.0
"""Between these the volume's intensity may lie."""
_BEYOND = 0.4
"""Metres by which the volume goes beyond the room: at its rim it fades into the world, whose light is no wall's."""


def probes(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The volumes that were baked here."""
    return [thing for thing in scene.objects if thing.type == "LIGHT_PROBE" and PROBE in thing]


def add_volume(scene: bpy.types.Scene) -> bpy.types.Object:
    """Put a volume over the room, an older one of ours goes; to be baked by `bake`. Raises `BadInputError`."""
    low, high = bounds(scene)
    remove(scene)
    data = bpy.data.lightprobes.new("Preview light", "VOLUME")
    thing = bpy.data.objects.new("Preview light", data)
    half = [(high[k] - low[k]) / 2 + _BEYOND for k in range(3)]
    thing.matrix_world = Matrix.LocRotScale((low + high) / 2, None, half)
    for axis, extent in zip("xyz", half, strict=True):
        setattr(data, f"resolution_{axis}", min(max(math.ceil(2 * extent / _STEP), 3), _MOST))
    _set(data, bake_samples=1024, capture_world=True, capture_indirect=True, capture_emission=True)
    _set(data, clamp_direct=0.0, clamp_indirect=0.0, surfel_density=15)
    thing[PROBE] = True
    own_collection(scene, COLLECTION).objects.link(thing)
    return thing


def bake(scene: bpy.types.Scene, wait: bool = True) -> bpy.types.Object:
    """Bake the room's light.

    Parameters
    ----------
    wait : bool
        Return when it is done; else, in a window, Blender bakes on, with a bar in its status line, and ESC ends that.

    Raises
    ------
    BadInputError
        There is no room, or no graphics card to bake on; nothing is left behind then.
    """
    if bpy.context.view_layer is None or bpy.context.scene != scene:
        raise BadInputError(f"Switch to scene '{scene.name}' first: what is baked is what the window shows.")
    if bpy.app.background:  # where a card may be missing, and baking says nothing of it
        _try_eevee(scene)
    thing = add_volume(scene)
    _set(scene.eevee, use_raytracing=True, use_shadows=True, light_threshold=0.001, gi_irradiance_pool_size="64")
    _set(scene.eevee, clamp_surface_direct=0.0, clamp_surface_indirect=0.0)
    for material in {slot.material for one in room_objects(scene) for slot in one.material_slots if slot.material}:
        # Places behind a wall count as within it then: they lend the wall neither the night nor the sun outside.
        material.use_backface_culling_lightprobe_volume = True
    layer = bpy.context.view_layer
    layer.update()
    active, layer.objects.active = layer.objects.active, thing
    try:
        how = "EXEC_DEFAULT" if wait else "INVOKE_DEFAULT"
        if "CANCELLED" in bpy.ops.object.lightprobe_cache_bake(how, subset="ACTIVE"):
            raise BadInputError(_NO_CARD)
    except (RuntimeError, BadInputError) as error:
        remove(scene)
        if isinstance(error, BadInputError):
            raise
        raise BadInputError(f"Blender can't bake the preview's light here: {reason_of(error)}.") from error
    finally:
        layer.objects.active = active
    return thing


def fit(scene: bpy.types.Scene) -> float:
    """Set the intensity of the baked volume so that EEVEE is as bright as Cycles; returns it, 1 where nothing tells.

    EEVEE's median luminance through a camera is about a + b * intensity, which two small pictures tell, and a third one
    by Cycles what it should be. Of several cameras the logarithms of the ratios count, squared.
    """
    volumes, cameras = probes(scene), _views(scene)
    if not volumes or not cameras:
        return 1.0
    data, before = volumes[0].data, scene.camera
    seen = np.zeros((3, len(cameras)))
    try:
        for row, (engine, intensity, samples) in enumerate(((CYCLES, 1.0, 16), (EEVEE, 1.0, 4), (EEVEE, 2.0, 4))):
            data.intensity = intensity
            for column, camera in enumerate(cameras):
                scene.camera = camera
                with suppress(BadInputError):  # EEVEE's is black
                    seen[row, column] = small_median(scene, engine, samples)
    finally:
        scene.camera, data.intensity = before, 1.0
    wanted, once, twice = seen[:, (seen[0] > 0) & (seen[1] > 0) & (seen[2] > seen[1])]
    if len(wanted):
        intensities = np.geomspace(_LEAST, _GREATEST, 241)
        got = np.maximum(once + (twice - once) * (intensities[:, None] - 1), 1e-3 * once)
        data.intensity = float(intensities[np.argmin((np.log2(got / wanted) ** 2).sum(1))])
    return data.intensity


def _views(scene) -> list[bpy.types.Object]:
    """The scene's camera, and some of the capture's, spread over its track."""
    others = frame_cameras(scene)
    chosen = [others[int(place)] for place in np.linspace(0, len(others) - 1, min(_VIEWS, len(others)))]
    return list(dict.fromkeys([*filter(None, (scene.camera,)), *chosen]))


def _try_eevee(scene) -> None:
    with tempfile.TemporaryDirectory(prefix="scan_relight_") as folder, settings_kept(scene):
        prepare(scene, EEVEE, 1)
        scene.render.resolution_x = scene.render.resolution_y = 8
        try:
            shoot(scene, Path(folder) / "try.png")
        except ScanRelightError as error:
            raise BadInputError(_NO_CARD) from error


def remove(scene: bpy.types.Scene) -> int:
    """Take away the volumes that were baked here; returns how many."""
    return remove_own(scene, COLLECTION, probes(scene))


def _set(owner, **values) -> None:
    """Set what this Blender's version has."""
    for name, value in values.items():
        if hasattr(owner, name):
            setattr(owner, name, value)
