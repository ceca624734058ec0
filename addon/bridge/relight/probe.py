"""Light probes for EEVEE: the room's indirect light baked into a volume, so that a preview is nearer to the render.

EEVEE has no light that bounces between surfaces, nor that of emissive surfaces, unless it is baked. The bake
alone leaves some rooms two stops too dark, so the volume's intensity is then fitted to small pictures by Cycles (see
docs/relighting.md). The volume extends beyond the walls, as it would otherwise mix their light with the world's,
and backfaces of the walls are culled, for worlds that shine in.
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
from .pictures import CYCLES, EEVEE, prepare, render_to_file, settings_kept, small_median

COLLECTION = "Preview Light"
PROBE = "scan_relight_probe"
"""Custom property of the probes that were made here."""
_NO_GPU = "EEVEE has no graphics card to bake the preview's light on here; use a Blender with a window, or Cycles."
_SPACING, _MAX_RESOLUTION = 0.3, 24
"""Metres between two samples of the volume, and how many of them a side has at most."""
_MAX_CAMERAS = 4
"""Cameras through which the baked light is compared with Cycles: the active one and some of the capture's."""
_MIN_INTENSITY, _MAX_INTENSITY = 0.05, 20.0
"""Range of the volume's intensity."""
_MARGIN = 0.4
"""Metres by which the volume extends beyond the room: at its rim it fades into the world's light."""


def probes(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The volumes that were baked here."""
    return [obj for obj in scene.objects if obj.type == "LIGHT_PROBE" and PROBE in obj]


def add_volume(scene: bpy.types.Scene) -> bpy.types.Object:
    """Put a volume over the room in place of an older one of ours; to be baked by `bake`. Raises `BadInputError`."""
    low, high = bounds(scene)
    remove(scene)
    data = bpy.data.lightprobes.new("Preview light", "VOLUME")
    obj = bpy.data.objects.new("Preview light", data)
    half_extents = [(high[k] - low[k]) / 2 + _MARGIN for k in range(3)]
    obj.matrix_world = Matrix.LocRotScale((low + high) / 2, None, half_extents)
    for axis, extent in zip("xyz", half_extents, strict=True):
        setattr(data, f"resolution_{axis}", min(max(math.ceil(2 * extent / _SPACING), 3), _MAX_RESOLUTION))
    _set_supported(data, bake_samples=1024, capture_world=True, capture_indirect=True, capture_emission=True)
    _set_supported(data, clamp_direct=0.0, clamp_indirect=0.0, surfel_density=15)
    obj[PROBE] = True
    own_collection(scene, COLLECTION).objects.link(obj)
    return obj


def bake(scene: bpy.types.Scene, wait: bool = True) -> bpy.types.Object:
    """Bake the room's light.

    Without `wait` Blender bakes on, in a window, with a bar in its status line, and ESC ends that. Raises
    `BadInputError`: there is no room, or no graphics card to bake on; nothing is changed then.
    """
    if bpy.context.view_layer is None or bpy.context.scene != scene:
        raise BadInputError(f"Switch to scene '{scene.name}' first: what is baked is what the window shows.")
    if bpy.app.background:  # where a graphics card may be missing, which baking does not report
        _try_eevee(scene)
    obj = add_volume(scene)
    _set_supported(scene.eevee, use_raytracing=True, use_shadows=True, light_threshold=0.001)
    _set_supported(scene.eevee, gi_irradiance_pool_size="64", clamp_surface_direct=0.0, clamp_surface_indirect=0.0)
    for material in {slot.material for item in room_objects(scene) for slot in item.material_slots if slot.material}:
        # Samples behind a wall then count as inside it: they give the wall neither darkness nor the sun outside.
        material.use_backface_culling_lightprobe_volume = True
    layer = bpy.context.view_layer
    layer.update()
    active, layer.objects.active = layer.objects.active, obj
    try:
        execution_context = "EXEC_DEFAULT" if wait else "INVOKE_DEFAULT"
        if "CANCELLED" in bpy.ops.object.lightprobe_cache_bake(execution_context, subset="ACTIVE"):
            raise BadInputError(_NO_GPU)
    except (RuntimeError, BadInputError) as error:
        remove(scene)
        if isinstance(error, BadInputError):
            raise
        raise BadInputError(f"Blender can't bake the preview's light here: {reason_of(error)}.") from error
    finally:
        layer.objects.active = active
    return obj


def fit(scene: bpy.types.Scene) -> float:
    """Set the intensity of the baked volume so that EEVEE is as bright as Cycles; returns it, 1 where that fails.

    EEVEE's median luminance through a camera is about a + b * intensity, measured by two small pictures; a third one by
    Cycles is the target. Over several cameras the squared logarithms of the ratios are minimized.
    """
    volumes, cameras = probes(scene), _comparison_cameras(scene)
    if not volumes or not cameras:
        return 1.0
    data, camera_before = volumes[0].data, scene.camera
    medians = np.zeros((3, len(cameras)))
    try:
        for row, (engine, intensity, samples) in enumerate(((CYCLES, 1.0, 16), (EEVEE, 1.0, 4), (EEVEE, 2.0, 4))):
            data.intensity = intensity
            for column, camera in enumerate(cameras):
                scene.camera = camera
                with suppress(BadInputError):  # EEVEE's picture is black
                    medians[row, column] = small_median(scene, engine, samples)
    finally:
        scene.camera, data.intensity = camera_before, 1.0
    target, at_one, at_two = medians[:, (medians[0] > 0) & (medians[1] > 0) & (medians[2] > medians[1])]
    if len(target):
        intensities = np.geomspace(_MIN_INTENSITY, _MAX_INTENSITY, 241)
        predicted = np.maximum(at_one + (at_two - at_one) * (intensities[:, None] - 1), 1e-3 * at_one)
        data.intensity = float(intensities[np.argmin((np.log2(predicted / target) ** 2).sum(1))])
    return data.intensity


def _comparison_cameras(scene) -> list[bpy.types.Object]:
    """The scene's camera, and some of the capture's, evenly along its track."""
    track = frame_cameras(scene)
    chosen = [track[int(position)] for position in np.linspace(0, len(track) - 1, min(_MAX_CAMERAS, len(track)))]
    return list(dict.fromkeys([*filter(None, (scene.camera,)), *chosen]))


def _try_eevee(scene) -> None:
    with tempfile.TemporaryDirectory(prefix="scan_relight_") as folder, settings_kept(scene):
        prepare(scene, EEVEE, 1)
        scene.render.resolution_x = scene.render.resolution_y = 8
        try:
            render_to_file(scene, Path(folder) / "try.png")
        except ScanRelightError as error:
            raise BadInputError(_NO_GPU) from error


def remove(scene: bpy.types.Scene) -> int:
    """Remove the volumes that were baked here; returns how many."""
    return remove_own(scene, COLLECTION, probes(scene))


def _set_supported(owner, **values) -> None:
    """Set the properties that this version of Blender has."""
    for name, value in values.items():
        if hasattr(owner, name):
            setattr(owner, name, value)
