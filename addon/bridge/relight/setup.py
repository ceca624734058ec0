"""The captured light, for the duration of a render; a light set-up as text, for other rooms.

New lights are stored relative to the camera, in units of the room's size and of its own light; lamps by their class,
with the artist's colour; the outside by its factor and rotation, a picture around the room by its path.
"""

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager

import bpy
from mathutils import Matrix, Vector

from ...core.errors import BadInputError
from ..light import lamps as relight_lamps
from ..light import outside as relight_outside
from ..light.room import bounds, cast, room_light, view_direction
from .aim import CLEARANCE
from .lights import KIND, PRESETS, added_lights, put_light, remove_lights

_NUMBERS = ("angle", "spread", "spot_size", "spot_blend", "temperature")
_LENGTHS = ("size", "size_y", "shadow_soft_size")


def setup_of(scene: bpy.types.Scene) -> str:
    """The light of a scene as JSON; raises `BadInputError` where it has no room."""
    to_frame, size = _camera_frame(scene).inverted(), _room_diagonal(scene)
    light, world = room_light(scene), scene.world
    lights = []
    for obj in added_lights(scene):
        data = obj.data
        entry = {"kind": obj[KIND], "type": data.type, "name": obj.name, "shown": not obj.hide_render}
        entry["pose"] = [list(row) for row in to_frame @ obj.matrix_world]
        entry |= {"color": list(data.color), "use_temperature": data.use_temperature}
        entry["energy"] = data.energy / light / _power_scale(data.type, size)
        entry |= {name: getattr(data, name) for name in _NUMBERS if hasattr(data, name)}
        entry |= {name: getattr(data, name) / size for name in _LENGTHS if hasattr(data, name)}
        lights.append(entry)
    lamps = relight_lamps.find_lamps(scene)
    changed = {}
    for lamp in filter(relight_lamps.is_changed, lamps):
        # Its colour only where it is the artist's: another room's lamps have colours of their own.
        tint = relight_lamps.colour(lamp) if relight_lamps.is_coloured(lamp) else None
        changed[_lamp_class(lamp)] = [relight_lamps.is_on(lamp), relight_lamps.factor(lamp), tint]
    state = relight_outside.snapshot(world)
    settings = {"lights": lights, "lamps": changed, "dark": not any(map(relight_lamps.is_on, lamps))}
    settings["outside"] = [state[name] for name in ("on", "factor", "rotation")] if state else None
    return json.dumps(settings | {"picture": world.get(relight_outside.HDRI) if world is not None else None})


def apply_setup(scene: bpy.types.Scene, text: str) -> list[str]:
    """Light a scene by a set-up of `setup_of`; its new lights are replaced, lamps of unknown classes are as captured.

    Returns a sentence where the picture around the room is missing: the recovered outside is used then.

    Raises
    ------
    BadInputError
        `text` is no set-up, or the scene has no room; nothing is changed then.
    """
    try:
        settings = json.loads(text)
        lights, outside = settings["lights"], settings["outside"]
        poses = [Matrix(entry["pose"]) for entry in lights]
        lamps = dict(settings["lamps"])
        states = {name: (bool(entry[0]), float(entry[1]), [*entry, None][2]) for name, entry in lamps.items()}
        kinds, types = ({entry[name] for entry in lights} for name in ("kind", "type"))
        valid = kinds <= set(PRESETS) and types <= {"AREA", "SPOT", "SUN", "POINT"}
        valid = valid and all(math.isfinite(c) for pose in poses for row in pose for c in row)
    except (ValueError, TypeError, KeyError, IndexError):
        valid = False
    if not valid:
        raise BadInputError("This preset holds no light that was saved here; save it anew.")
    frame, size, light = _camera_frame(scene), _room_diagonal(scene), room_light(scene)
    remove_lights(scene)
    for entry, pose in zip(lights, poses, strict=True):
        data = bpy.data.lights.new(entry["name"], entry["type"])
        data.energy = entry["energy"] * light * _power_scale(data.type, size)
        data.color, data.use_temperature = entry["color"], entry["use_temperature"]
        for name in (*_NUMBERS, *_LENGTHS):
            if name in entry and hasattr(data, name):
                setattr(data, name, entry[name] * (size if name in _LENGTHS else 1.0))
        if data.type == "AREA":
            data.shape = "RECTANGLE"
        world_pose = frame @ pose
        if data.type != "SUN":
            world_pose.translation = _inside_room(scene, frame.translation, world_pose.translation)
        pose = Matrix.LocRotScale(world_pose.translation, world_pose.to_quaternion(), None)
        put_light(scene, entry["kind"], data, pose).hide_render = not entry["shown"]
    for lamp in relight_lamps.find_lamps(scene):
        on, factor, tint = states.get(_lamp_class(lamp), (not settings.get("dark"), 1.0, None))
        changed = tint is not None or not on or factor != 1.0
        state = {"on": on, "factor": factor, "colour": tint, "touched": changed}
        relight_lamps.put_back(lamp, state)
    remarks = _apply_picture(scene, settings.get("picture"))
    if outside is not None and scene.world is not None:
        state = dict(zip(("on", "factor", "rotation"), outside, strict=True))
        relight_outside.put_back(scene.world, state | {"touched": True})
    return remarks


def _power_scale(kind: str, size: float) -> float:
    """Scale of a lamp's power with the room: the square of its size; a sun's does not scale."""
    return 1.0 if kind == "SUN" else size**2


def _apply_picture(scene, picture: str | None) -> list[str]:
    """Put a picture around the room, or restore the recovered outside; returns remarks."""
    relight_outside.restore(scene)
    if not picture:
        return []
    try:
        relight_outside.use_hdri(scene, picture, relight_outside.outdoor_radiance(scene))
    except BadInputError:
        return [f"The picture around the room, '{picture}', is gone; the recovered outside shines instead."]
    return relight_outside.remarks(scene)


def _camera_frame(scene) -> Matrix:
    """The camera's horizontal frame, in units of the room's size: right, ahead, up."""
    low, high = bounds(scene)
    ahead = view_direction(scene)
    origin = scene.camera.matrix_world.translation if scene.camera else (low + high) / 2
    turn = Matrix(((ahead.y, ahead.x, 0), (-ahead.x, ahead.y, 0), (0, 0, 1))).to_4x4()
    return Matrix.Translation(origin) @ turn @ Matrix.Scale(_room_diagonal(scene), 4)


def _room_diagonal(scene) -> float:
    """Diagonal of the room, metres."""
    low, high = bounds(scene)
    return max((high - low).length, 1e-3)


def _inside_room(scene, eye: Vector, position: Vector) -> Vector:
    """A position inside the room: from the camera towards `position`, up to the first surface."""
    offset = position - eye
    if offset.length < 1e-6:
        return position
    hit = cast(scene, eye, offset, offset.length + CLEARANCE)
    low, high = bounds(scene)
    clear_position = eye + offset.normalized() * max(hit.distance - CLEARANCE, 0.0) if hit else position
    return Vector(min(max(clear_position[k], low[k] + CLEARANCE), high[k] - CLEARANCE) for k in range(3))


def _lamp_class(lamp) -> str:
    return lamp.name.casefold().rpartition(" ")[0] or lamp.name.casefold()


@contextmanager
def captured_light(scene: bpy.types.Scene) -> Iterator[None]:
    """Within: recovered lamps and world, no other lights. Afterwards: exactly the artist's light again."""
    world, stored_world = scene.world, scene.get(relight_outside.RECOVERED)
    hidden = {obj: obj.hide_render for obj in scene.objects if obj.type == "LIGHT"}
    states = [(lamp, relight_lamps.snapshot(lamp)) for lamp in relight_lamps.find_lamps(scene)]
    recovered = relight_outside.recovered_world(scene)
    outside = relight_outside.snapshot(recovered)
    try:
        _restore_found(scene)
        for obj in hidden:
            obj.hide_render = True
        yield
    finally:
        for lamp, state in states:
            relight_lamps.put_back(lamp, state)
        scene.world = world
        relight_outside.put_back(recovered, outside)
        if stored_world is not None:
            scene[relight_outside.RECOVERED] = stored_world
        for obj, hide_render in hidden.items():
            obj.hide_render = hide_render


def is_relit(scene: bpy.types.Scene) -> bool:
    """Whether the scene's light differs from the captured one."""
    return (
        any(map(relight_lamps.is_changed, relight_lamps.find_lamps(scene)))
        or relight_outside.is_changed(scene)
        or any(not light.hide_render for light in added_lights(scene))
    )


def restore_captured(scene: bpy.types.Scene) -> None:
    """Restore the captured light permanently: lamps and outside restored, added lights removed."""
    _restore_found(scene)
    remove_lights(scene)


def _restore_found(scene) -> None:
    for lamp in relight_lamps.find_lamps(scene):
        relight_lamps.restore(lamp)
    relight_outside.restore(scene)
