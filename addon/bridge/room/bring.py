"""The recovered room in the open file. All of it comes out of the result's scene.blend: one code path makes the room.

A capture has one room in a file. Where it is there already, `bringing` updates it (`room.update`): what the artist did
to it stays.
"""

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

import bpy

from ...core.errors import BadInputError, MissingStageError
from ...core.io.folder import SCENE
from ...core.results.room_file import ROOM, root_of, run_of
from ..data.added import Made
from ..data.cameras import show_camera
from ..marks import IMAGE, OWN_SCENE, RESULT, UV_MAP, mark
from ..results import changes as room_changes
from ..results import images
from ..scene.as_made import stamp, stamp_tree
from ..scene.parts import dress, find_room, hide_cameras, imported, own_scene, rooms, scene_name, take_settings
from .update import commit, note_known, plan


@dataclass(frozen=True)
class Brought:
    """What came into the file.

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
) -> Generator[float, None, Brought]:
    """Bring a finished result's room into the open file, or update the one that is there; yields the share done.

    Nothing that was in the file changes before the last slice: a generator that fails, or is closed before, leaves all
    as it was.

    Parameters
    ----------
    folder : Path or str
        The result folder.
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
    BadInputError
        scene.blend is damaged, or `where` is a folder beside a file that was never saved.
    StorageError
        Images can't be copied.
    """
    folder = Path(folder).absolute()
    root = root_of(folder)
    if root is None:
        raise MissingStageError(
            f"Folder '{folder}' holds no finished result ('{ROOM}' is missing or damaged); run the "
            "recovery to its end first."
        )
    top = imported(root) if known else find_room(root)
    made = Made()
    try:
        yield 0.0
        shell = _append(folder / SCENE)
        yield 0.4
        fresh = next(iter(rooms(shell)), shell.collection.children[0])  # an older one is not marked
        run = run_of(folder)
        things = list(fresh.all_objects)
        for owner in (fresh, *things):
            mark(owner, folder, run, root)
        for done, thing in enumerate(things, 1):  # a scene.blend of an older version has no stamps
            stamp(thing)
            if not done % 16:
                yield 0.4 + 0.2 * done / len(things)
        if shell.world is not None:
            stamp_tree(shell.world)
        now = room_changes.read_findings(folder)
        steps = None
        if top is not None:
            steps = yield from plan(top, fresh)
        yield 0.95
        images.settle(_images(made, folder), where)
        for name in (images.ALBEDO, images.SHADING):  # shown by nothing yet, but asked for by name
            if (folder / name).exists():
                images.image(folder, name, where)
    except BaseException:
        made.remove()
        raise
    if top is not None:
        _replace_images(made, top)
    warnings: list[str] = []
    if steps is None:
        top, differences = fresh, ()
        note_known(top, things)
    else:
        differences = room_changes.compare(room_changes.stored_findings(top), now)
        warnings = commit(steps, top, fresh, shell)
        shell.collection.children.unlink(fresh)
    room_changes.store_findings(top, now)
    place, kept = _place(top, shell, scene, root, steps is None)
    room_changes.store_changes(place, differences)
    made.remove_unused(steps.replaced if steps is not None else ())
    for one, label in steps.names if steps is not None else ():
        one.name = label
    yield 0.98
    ready(place)
    return Brought(place, top, (*warnings, *kept))


def ready(scene: bpy.types.Scene) -> None:
    """Show the camera that a scene is looked through; without the update no matrix_world is right before it is."""
    if scene.camera is not None:
        show_camera(scene, scene.camera)
    scene.view_layers[0].update()


def _append(path: Path) -> bpy.types.Scene:
    """The scene of a result's scene.blend, appended by Blender itself."""
    if not path.is_file():
        raise MissingStageError(f"Folder '{path.parent}' holds no {path.name}; run the recovery to its end first.")
    try:
        with bpy.data.libraries.load(str(path), link=False) as (there, wanted):
            wanted.scenes = there.scenes[:1]
    except OSError as error:
        raise BadInputError(
            f"'{path}' can't be read by Blender {bpy.app.version_string}; run the recovery again from its last stage."
        ) from error
    if not wanted.scenes or wanted.scenes[0] is None or not wanted.scenes[0].collection.children:
        raise BadInputError(f"'{path}' holds no room; run the recovery again from its last stage.")
    return wanted.scenes[0]


def _images(made: Made, folder: Path) -> list[bpy.types.Image]:
    found = [image for image in made.new("images") if image.source in ("FILE", "TILED") and image.filepath]
    for image in found:
        path = Path(image.filepath.replace("\\", "/"))
        own = UV_MAP in image and image.source == "FILE"  # an object's, in a folder below the result's
        image[IMAGE] = str(folder / path.parent.name / path.name if own else folder / path.name)
    return found


def _replace_images(made: Made, top: bpy.types.Collection) -> None:
    """Let the images that came stand for those of the same name that the room had from another result folder."""
    came = {Path(image[IMAGE]).name: image for image in made.new("images") if IMAGE in image}
    for image in [one for one in bpy.data.images if one.get(IMAGE) and not one.library]:
        path = Path(image[IMAGE])
        if path.name in came and came[path.name] != image and path.is_relative_to(top.get(RESULT, "")):
            images.replace(image, came[path.name])


def _place(top, shell, scene, root: str, new: bool) -> tuple[bpy.types.Scene, list[str]]:
    """Have the room in `scene`, or in one of its own: the scene to see it in, and what stays as the artist has it."""
    kept: list[str] = []
    own = None if new else own_scene(top)
    if own is not None:
        kept = take_settings(own, shell)
    if scene is not None:
        link_room(top, scene)
    if scene is None and own is None:
        link_room(top, shell)
        shell.name, shell[OWN_SCENE] = scene_name(root), True
        dress(shell)
        return shell, kept
    bpy.data.scenes.remove(shell)
    return scene or own, kept


def link_room(top: bpy.types.Collection, scene: bpy.types.Scene, outside: bpy.types.Scene | None = None) -> None:
    """Show a room in another scene as well.

    Parameters
    ----------
    outside : bpy.types.Scene, optional
        Give `scene` the world and the exposure of this one, too.
    """
    if top not in scene.collection.children_recursive:
        scene.collection.children.link(top)
        hide_cameras(scene, top)
    if outside is not None:
        scene.world, scene.view_settings.exposure = outside.world, outside.view_settings.exposure
