"""The recovered room in the open file. All of it is appended from the result's scene.blend: one code path makes rooms.

A capture has one room in a file. Where it is there already, `bringing` updates it (`room.update`): what the artist did
to it stays.
"""

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

import bpy

from ...core.errors import MissingStageError
from ...core.io.folder import SCENE
from ...core.results.room_file import ROOM, root_of, run_of
from ..custom_properties import IMAGE, OWN_SCENE, RESULT, set_run
from ..data.added import AddedData
from ..data.cameras import show_camera
from ..data.images import mark_appended
from ..results import changes as room_changes
from ..results import images
from ..scene.as_made import stamp, stamp_tree
from ..scene.parts import (
    dress,
    find_room,
    hide_cameras,
    imported,
    load_scene,
    own_scene,
    rooms,
    scene_name,
    take_settings,
)
from .update import Steps, commit, note_known, plan


@dataclass(frozen=True)
class ImportedRoom:
    """A room that was brought into the file.

    Attributes
    ----------
    scene : bpy.types.Scene
        Where the room is to be seen: the scene that was named, or the room's own.
    warnings : tuple of str
        What was left as the artist has it, one sentence each.
    """

    scene: bpy.types.Scene
    collection: bpy.types.Collection
    warnings: tuple[str, ...] = ()


def bringing(
    folder: Path | str, scene: bpy.types.Scene | None = None, where: str = images.RESULT, known: bool = False
) -> Generator[float, None, ImportedRoom]:
    """Bring a finished result's room into the open file, or update the one that is there; yields the share done.

    Nothing that was in the file changes before the last slice: a generator that fails, or is closed before, leaves all
    as it was.

    Parameters
    ----------
    scene : bpy.types.Scene, optional
        Link the room into this scene and change nothing else of it. By default the room has a scene of its own,
        "Scan Relight: <capture>", with its world, exposure, engine and camera; no other scene is touched.
    where : str
        Where the images go: see `results.images`.
    known : bool
        Only update a room that is there.

    Raises
    ------
    MissingStageError
        The folder holds no finished result; with `known`, the file holds no room of that capture.
    BadInputError, StorageError
        scene.blend is damaged, or `where` is a folder beside a file that was never saved; images can't be copied.
    """
    folder = Path(folder).absolute()
    root = root_of(folder)
    if root is None:
        raise MissingStageError(
            f"Folder '{folder}' holds no finished result ('{ROOM}' is missing or damaged); run the "
            "recovery to its end first."
        )
    top = imported(root) if known else find_room(root)
    is_new, steps, added = top is None, Steps(), AddedData()
    try:
        yield 0.0
        shell = load_scene(folder / SCENE)
        yield 0.4
        fresh = next(iter(rooms(shell)), shell.collection.children[0])  # an older one is not marked
        run = run_of(folder)
        objects = list(fresh.all_objects)
        for owner in (fresh, *objects):
            set_run(owner, folder, run, root)
        for done, obj in enumerate(objects, 1):  # a scene.blend of an older version has no stamps
            stamp(obj)
            if not done % 16:
                yield 0.4 + 0.2 * done / len(objects)
        if shell.world is not None:
            stamp_tree(shell.world)
        findings = room_changes.read_findings(folder)
        if not is_new:
            steps = yield from plan(top, fresh)
        yield 0.95
        images.settle(mark_appended(added.new("images"), folder), where)
        for name in (images.ALBEDO, images.SHADING):  # shown by nothing yet, but asked for by name
            if (folder / name).exists():
                images.image(folder, name, where)
    except BaseException:
        added.remove()
        raise
    warnings, differences = [], ()
    if is_new:
        top = fresh
        note_known(top, objects)
    else:
        _replace_images(added, top)
        differences = room_changes.compare(room_changes.stored_findings(top), findings)
        warnings = commit(steps, top, fresh, shell)
        shell.collection.children.unlink(fresh)
    room_changes.store_findings(top, findings)
    target, messages = _place(top, shell, scene, root, is_new)
    room_changes.store_changes(target, differences)
    added.remove_unused(steps.replaced)
    for datablock, label in steps.names:
        datablock.name = label
    yield 0.98
    ready(target)
    return ImportedRoom(target, top, (*warnings, *messages))


def ready(scene: bpy.types.Scene) -> None:
    """Show the scene's active camera and update its view layer, as every matrix_world is out of date until then."""
    if scene.camera is not None:
        show_camera(scene, scene.camera)
    scene.view_layers[0].update()


def _replace_images(added: AddedData, top: bpy.types.Collection) -> None:
    """Replace the images that the room had from another result folder by the new ones of the same name."""
    new = {Path(image[IMAGE]).name: image for image in added.new("images") if IMAGE in image}
    for image in [existing for existing in bpy.data.images if existing.get(IMAGE) and not existing.library]:
        path = Path(image[IMAGE])
        if path.name in new and new[path.name] != image and path.is_relative_to(top.get(RESULT, "")):
            images.replace(image, new[path.name])


def _place(top, shell, scene, root: str, new: bool) -> tuple[bpy.types.Scene, list[str]]:
    """Put the room into `scene`, or one of its own; returns the scene that shows it, and what stays the artist's."""
    room_scene = None if new else own_scene(top)
    messages = [] if room_scene is None else take_settings(room_scene, shell)
    if scene is not None:
        link_room(top, scene)
    if scene is None and room_scene is None:
        link_room(top, shell)
        shell.name, shell[OWN_SCENE] = scene_name(root), True
        dress(shell)
        return shell, messages
    bpy.data.scenes.remove(shell)
    return scene or room_scene, messages


def link_room(top: bpy.types.Collection, scene: bpy.types.Scene, outside: bpy.types.Scene | None = None) -> None:
    """Show a room in another scene as well; with `outside` it gets that scene's world and exposure, too."""
    if top not in scene.collection.children_recursive:
        scene.collection.children.link(top)
        hide_cameras(scene, top)
    if outside is not None:
        scene.world, scene.view_settings.exposure = outside.world, outside.view_settings.exposure
