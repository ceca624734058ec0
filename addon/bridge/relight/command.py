"""The command `relight`: a result's scene rendered under another light; the file itself is not changed."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from ...core.errors import BadInputError
from ...core.io.folder import SCENE
from ...core.progress import Progress
from ..data.cameras import frame_cameras, use_camera
from ..light import lamps as relight_lamps
from ..light import outside
from ..light.kelvin import rgb_of
from ..render_device import use_device
from .before_after import render_pair
from .lights import SOFTBOX, SPOT, SUN, WINDOW, add_light
from .pictures import CYCLES, check_format, prepare, render_stage, settings_kept


@dataclass(frozen=True)
class Light:
    """Changes to the light; None leaves it as in the file.

    Attributes
    ----------
    lamps : str or None
        'on', 'off', or NAME=FACTOR and NAME=off, separated by commas; a name stands for one lamp or a class of them.
    world : str or None
        'on', 'off', or degrees by which the outside is turned, anticlockwise from above.
    hdri : Path or None
        Picture to put around the room.
    added : dict of str to (float, str)
        Strength of each new light and its unit (`light.units.ROOM` and its neighbours), by `relight.lights.PRESETS`.
    kelvin : float or None
        Color temperature of the new lights; None: the default of each.
    """

    lamps: str | None = None
    world: str | None = None
    world_strength: float | None = None
    hdri: Path | None = None
    added: dict[str, tuple[float, str]] = field(default_factory=dict)
    kelvin: float | None = None


def relight(
    result: Path,
    light: Light,
    out: Path,
    camera: str | None = None,
    samples: int = 0,
    engine: str = CYCLES,
    before_after: bool = False,
    percentage: int = 100,
    progress: Progress | None = None,
    device: str | None = None,
    scene_name: str | None = None,
) -> list[str]:
    """Open a result's scene, change its light, render.

    Parameters
    ----------
    camera : str, optional
        Number of a frame in the capture's order, from 0, or its name; by default the scene's camera.
    samples, engine, percentage
        See `pictures.prepare`.
    before_after : bool
        Two pictures beside each other: the captured light, the new one.
    device : str, optional
        See `render_device.use_device`; by default the file's, which Cycles may ignore without preferences.
    scene_name : str, optional
        Name of the scene, where the file holds several; by default the one that it was saved with.

    Returns
    -------
    list of str
        Remarks, one sentence each.

    Raises
    ------
    BadInputError, StorageError
        One sentence for the user; nothing is rendered if any argument is wrong.
    """
    progress = progress or Progress()
    check_format(out)
    path = Path(result) / SCENE
    if not path.is_file():
        raise BadInputError(f"Result folder '{result}' holds no {SCENE}; run 'recover CAPTURE --out {result}' first.")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.absolute()), load_ui=False)
    except RuntimeError as error:
        raise BadInputError(
            f"'{path}' can't be opened by Blender {bpy.app.version_string}; recover the capture again."
        ) from error
    scene = scene_named(scene_name)
    if camera is not None:
        use_camera(scene, camera_named(scene, camera))
    if scene.camera is None:
        raise BadInputError(f"'{path}' has no camera to render through.")
    remarks = apply_light(scene, light)
    with settings_kept(scene):
        if device is not None and engine == CYCLES:
            remarks += filter(None, [use_device(scene, device)])
        prepare(scene, engine, samples, percentage)
        if before_after:
            render_pair(scene, out, progress)
        else:
            render_stage(scene, out, progress, "after")
    return remarks


def scene_named(name: str | None) -> bpy.types.Scene:
    """A scene of the open file, made the active one; raises `BadInputError` where there is none."""
    scene = bpy.context.scene if name is None else bpy.data.scenes.get(name)
    if scene is None:
        names = ", ".join(f"'{item.name}'" for item in bpy.data.scenes)
        raise BadInputError(f"There is no scene '{name}' in the file; it holds {names}.")
    if bpy.context.window is not None:
        bpy.context.window.scene = scene
    return scene


def apply_light(scene: bpy.types.Scene, light: Light) -> list[str]:
    """Change a scene's light; returns remarks, raises `BadInputError` where something is unknown."""
    if light.kelvin is not None:
        rgb_of(light.kelvin)  # which raises where there is no such temperature
    if light.lamps is not None:
        set_lamps(scene, light.lamps)
    if light.hdri is not None:
        outside.use_hdri(scene, light.hdri, outside.outdoor_radiance(scene))
    if scene.world is not None and light.world is not None:
        if light.world not in ("on", "off"):
            message = f"Option --world takes on, off or an angle in degrees, not '{light.world}'."
            outside.set_rotation(scene.world, math.radians(_number(light.world, message)))
        outside.set_on(scene.world, light.world != "off")
    if scene.world is not None and light.world_strength is not None:
        outside.set_factor(scene.world, light.world_strength)
    for preset, (strength, unit) in light.added.items():
        add_light(scene, preset, strength, kelvin=light.kelvin, unit=unit)
    return outside.remarks(scene) if light.hdri is not None else []


def set_lamps(scene: bpy.types.Scene, text: str) -> None:
    """Apply the option ``--lamps``; all of it is checked before anything changes."""
    changes = []
    for part in text.split(",") if text not in ("on", "off") else ():
        name, separator, value = part.rpartition("=")
        if not separator:
            raise BadInputError(f"Option --lamps takes on, off or NAME=FACTOR, separated by commas, not '{part}'.")
        factors = {"off": None, "on": 1.0}
        if value not in factors:
            factors[value] = _number(value, f"Option --lamps takes factors of at least 0, not '{value}'.", 0.0)
        changes += [(lamp, factors[value]) for lamp in relight_lamps.lamp_named(scene, name)]
    for lamp, value in changes:
        relight_lamps.set_on(lamp, value is not None)
        if value is not None:
            relight_lamps.set_factor(lamp, value)
    if text in ("on", "off"):
        for lamp in relight_lamps.find_lamps(scene):
            relight_lamps.set_on(lamp, text == "on")


def camera_named(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    """The camera of a frame, by its number from 0 or its name; raises `BadInputError`."""
    cameras = frame_cameras(scene)
    by_name = {str(number): camera for number, camera in enumerate(cameras)}
    by_name |= {camera.name: camera for camera in reversed(cameras)}
    if name in by_name:
        return by_name[name]
    examples = ", ".join(f"'{c.name}'" for c in cameras[:3])
    hint = f"take a number from 0 to {len(cameras) - 1} or a name such as {examples}"
    raise BadInputError(f"There is no camera '{name}'; {hint if cameras else 'the scene has none at all'}.")


def _number(text: str, message: str, minimum: float = -math.inf) -> float:
    """Parse a number of at least `minimum`; raises `BadInputError` with `message` otherwise."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= minimum):
        raise BadInputError(message)
    return value


OPTIONS = {"window": WINDOW, "softbox": SOFTBOX, "spot": SPOT, "sun": SUN}
"""Options of the command line that add a light."""
