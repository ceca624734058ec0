"""The light as it was captured, for as long as a picture of it takes; a set-up of light as text, for other rooms.

New lights are kept as seen by the camera, in units of the room's size and of its own light; lamps by their class, with
the colour that the artist gave them; the outside by its factor and turn, a picture around the room by its path.
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
from .aim import CLEAR
from .lights import KIND, PRESETS, added_lights, put_light, remove_lights

_NUMBERS = ("angle", "spread", "spot_size", "spot_blend", "temperature")
_LENGTHS = ("size", "size_y", "shadow_soft_size")


def setup_of(scene: bpy.types.Scene) -> str:
    """The light of a scene as JSON; raises `BadInputError` where it holds no room."""
    back, size, light, world = _frame(scene).inverted(), _size(scene), room_light(scene), scene.world
    lights = []
    for thing in added_lights(scene):
        data = thing.data
        told = {"kind": thing[KIND], "type": data.type, "name": thing.name, "shown": not thing.hide_render}
        told["pose"] = [list(row) for row in back @ thing.matrix_world]
        told |= {"color": list(data.color), "use_temperature": data.use_temperature}
        told["energy"] = data.energy / light / _power(data.type, size)
        told |= {name: getattr(data, name) for name in _NUMBERS if hasattr(data, name)}
        told |= {name: getattr(data, name) / size for name in _LENGTHS if hasattr(data, name)}
        lights.append(told)
    lamps = relight_lamps.find_lamps(scene)
    changed = {}
    for lamp in filter(relight_lamps.is_changed, lamps):
        # Its colour only where it is the artist's: another room's lamps have colours of their own.
        tint = relight_lamps.colour(lamp) if relight_lamps.is_coloured(lamp) else None
        changed[_class(lamp)] = [relight_lamps.is_on(lamp), relight_lamps.factor(lamp), tint]
    state = relight_outside.snapshot(world)
    told = {"lights": lights, "lamps": changed, "dark": not any(map(relight_lamps.is_on, lamps))}
    told["outside"] = [state[name] for name in ("on", "factor", "rotation")] if state else None
    return json.dumps(told | {"picture": world.get(relight_outside.HDRI) if world is not None else None})


def apply_setup(scene: bpy.types.Scene, text: str) -> list[str]:
    """Light a scene as `setup_of` told; its new lights are replaced, lamps of unknown classes are as captured.

    Returns
    -------
    list of str
        One sentence where the picture around the room is gone: the recovered outside shines then.

    Raises
    ------
    BadInputError
        It is no set-up, or the scene holds no room; nothing is changed then.
    """
    try:
        told = json.loads(text)
        lights, outside = told["lights"], told["outside"]
        poses = [Matrix(one["pose"]) for one in lights]
        states = {name: (bool(one[0]), float(one[1]), [*one, None][2]) for name, one in dict(told["lamps"]).items()}
        known = all(math.isfinite(c) for pose in poses for row in pose for c in row) and all(
            one["kind"] in PRESETS and one["type"] in ("AREA", "SPOT", "SUN", "POINT") for one in lights
        )
    except (ValueError, TypeError, KeyError, IndexError):
        known = False
    if not known:
        raise BadInputError("This preset holds no light that was saved here; save it anew.")
    frame, size, light = _frame(scene), _size(scene), room_light(scene)
    remove_lights(scene)
    for one, pose in zip(lights, poses, strict=True):
        data = bpy.data.lights.new(one["name"], one["type"])
        data.energy = one["energy"] * light * _power(data.type, size)
        data.color, data.use_temperature = one["color"], one["use_temperature"]
        for name in (*_NUMBERS, *_LENGTHS):
            if name in one and hasattr(data, name):
                setattr(data, name, one[name] * (size if name in _LENGTHS else 1.0))
        if data.type == "AREA":
            data.shape = "RECTANGLE"
        place = frame @ pose
        if data.type != "SUN":
            place.translation = _within(scene, frame.translation, place.translation)
        pose = Matrix.LocRotScale(place.translation, place.to_quaternion(), None)
        put_light(scene, one["kind"], data, pose).hide_render = not one["shown"]
    for lamp in relight_lamps.find_lamps(scene):
        on, factor, tint = states.get(_class(lamp), (not told.get("dark"), 1.0, None))
        touched = tint is not None or not on or factor != 1.0
        state = {"on": on, "factor": factor, "colour": tint, "touched": touched}
        relight_lamps.put_back(lamp, state)
    remarks = _put_picture(scene, told.get("picture"))
    if outside is not None and scene.world is not None:
        state = dict(zip(("on", "factor", "rotation"), outside, strict=True))
        relight_outside.put_back(scene.world, state | {"touched": True})
    return remarks


def _power(kind: str, size: float) -> float:
    """What power goes with in a room: the square of its size, but a sun's does not."""
    return 1.0 if kind == "SUN" else size**2


def _put_picture(scene, picture: str | None) -> list[str]:
    """Put a picture around the room, or the recovered outside; returns what there is to say."""
    relight_outside.restore(scene)
    if not picture:
        return []
    try:
        relight_outside.use_hdri(scene, picture, relight_outside.usual_radiance(scene))
    except BadInputError:
        return [f"The picture around the room, '{picture}', is gone; the recovered outside shines instead."]
    return relight_outside.remarks(scene)


def _frame(scene) -> Matrix:
    """The level frame of who looks through the camera, in units of the room's size: right, ahead, up."""
    low, high = bounds(scene)
    ahead = view_direction(scene)
    origin = scene.camera.matrix_world.translation if scene.camera else (low + high) / 2
    turn = Matrix(((ahead.y, ahead.x, 0), (-ahead.x, ahead.y, 0), (0, 0, 1))).to_4x4()
    return Matrix.Translation(origin) @ turn @ Matrix.Scale(_size(scene), 4)


def _size(scene) -> float:
    """Metres: the diagonal of the room."""
    low, high = bounds(scene)
    return max((high - low).length, 1e-3)


def _within(scene, eye: Vector, place: Vector) -> Vector:
    """A place inside the room: as far from the camera towards `place` as nothing is in the way."""
    way = place - eye
    if way.length < 1e-6:
        return place
    hit = cast(scene, eye, way, way.length + CLEAR)
    low, high = bounds(scene)
    reached = eye + way.normalized() * max(hit.distance - CLEAR, 0.0) if hit else place
    return Vector(min(max(reached[k], low[k] + CLEAR), high[k] - CLEAR) for k in range(3))


def _class(lamp) -> str:
    return lamp.name.casefold().rpartition(" ")[0] or lamp.name.casefold()


@contextmanager
def captured_light(scene: bpy.types.Scene) -> Iterator[None]:
    """Within: recovered lamps and world, no other lamp of Blender's. Afterwards: the artist's light again, exactly."""
    lamps = relight_lamps.find_lamps(scene)
    world, kept_world = scene.world, scene.get(relight_outside.RECOVERED)
    hidden = {thing: thing.hide_render for thing in scene.objects if thing.type == "LIGHT"}
    states = [(lamp, relight_lamps.snapshot(lamp)) for lamp in lamps]
    recovered = relight_outside.recovered_world(scene)
    outside = relight_outside.snapshot(recovered)
    try:
        for lamp in lamps:
            relight_lamps.restore(lamp)
        relight_outside.restore(scene)
        for thing in hidden:
            thing.hide_render = True
        yield
    finally:
        for lamp, state in states:
            relight_lamps.put_back(lamp, state)
        scene.world = world
        relight_outside.put_back(recovered, outside)
        if kept_world is not None:
            scene[relight_outside.RECOVERED] = kept_world
        for thing, was in hidden.items():
            thing.hide_render = was


def is_relit(scene: bpy.types.Scene) -> bool:
    """Whether the scene's light differs from the captured one."""
    return (
        any(map(relight_lamps.is_changed, relight_lamps.find_lamps(scene)))
        or relight_outside.is_changed(scene)
        or any(not light.hide_render for light in added_lights(scene))
    )


def restore_captured(scene: bpy.types.Scene) -> None:
    """Back to the captured light for good: lamps and outside restored, added lights removed."""
    for lamp in relight_lamps.find_lamps(scene):
        relight_lamps.restore(lamp)
    relight_outside.restore(scene)
    remove_lights(scene)
