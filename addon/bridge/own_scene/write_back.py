"""Recovered materials onto the artist's own objects, and back to what they wore before.

Every slot of an object takes the recovered material, so its faces' slot numbers stay as they are. What the slots held
is kept on the object as references to the materials themselves: they survive renaming, saving and opening. A mesh that
several objects share is copied for each, as each has a place of its own in the atlas; the shared one is kept likewise.
"""

from collections import Counter
from collections.abc import Generator, Iterable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...core.brdf.material import ObjectMaterial, undescribed
from ...core.errors import BadInputError, MissingStageError
from ...core.results.room_file import run_of
from ...core.scene.model import Capture
from ..data.arrays import faces_of, read, set_layer, vertices_of
from ..data.materials import MODEL, make_material
from ..data.mesh_objects import ATLAS_UV
from ..light.room import depsgraph_of
from ..marks import OBJECT_ID, RESULT, RUN, mark
from ..refused import sentences
from ..results import images
from .capture import Source, check_own, polygons_of, sources
from .mesh import Part, gather, same_topology, topology_hash

BEFORE = "scan_relight_before"
"""Custom property of an object: what it wore before."""
COPY_OF = "scan_relight_copy_of"
"""Custom property of a copy: the object that it stands for."""
ASIDE = "ScanRelight before"
"""Name that texture coordinates get that already had ours."""
AUTO, IMPORTED, SELECTED = "AUTO", "IMPORTED", "SELECTED"
"""What materials go onto: what the capture came from; the capture's imported objects; the artist's own."""
SUFFIX = " (Scan Relight)"


def is_own(capture_folder: Path | str, target: str = AUTO) -> bool:
    """Whether a capture's materials belong onto the artist's own objects."""
    return target == SELECTED or target == AUTO and bool(sources(capture_folder))


def writing_back(
    scene: bpy.types.Scene,
    capture: Capture,
    atlas_uv: np.ndarray,
    materials: Iterable[ObjectMaterial],
    result_folder: Path | str,
    where: str = images.RESULT,
    copies: bool = False,
) -> Generator[float, None, tuple[str, ...]]:
    """Put the recovered materials onto the objects that a capture was made of, in slices of an object each.

    It yields the share done, so that a window can be drawn.

    Parameters
    ----------
    capture : Capture
        Made by `capture_scene`.
    atlas_uv : (t, 3, 2) float32
    where : str
        Where the images go: see `results.images`.
    copies : bool
        Make a copy, with its faces fixed, of each object whose faces come from modifiers or instances, and hide the
        object itself; without it such objects are left as they are.

    Returns
    -------
    tuple of str
        Warnings, one sentence each.

    Raises
    ------
    MissingStageError
        The capture was not made of a scene.
    BadInputError
        An image can't be read, or the images' folder can't be told.
    """
    known, polygons = sources(capture.root), polygons_of(capture.root, capture.mesh)
    check_own(capture.root)
    if polygons is None:
        raise MissingStageError(f"Capture '{capture.root}' is damaged; capture the scene again.")
    base_color = images.bring(result_folder, where)
    corner_uv, torn = corners_of(polygons, atlas_uv)
    descriptions = {one.object_id: one for one in materials}
    work = _Work(scene, Path(result_folder).absolute(), base_color)
    gone, edited, made, locked, torn_names = [], [], [], [], []
    for done, source in enumerate(known):
        yield done / len(known)
        thing = scene.objects.get(source.thing)
        if thing is None:
            gone.append(source.name)
            continue
        if thing.library or thing.override_library:
            locked.append(source.name)
            continue
        description = descriptions.get(source.object_id) or undescribed(source.object_id, source.name)
        own = corner_uv[source.corner_start :]
        if not source.own:
            made.append((source, thing, description, own))
        elif thing.type != "MESH" or topology_hash([faces_of(thing.data)]) != source.topology:
            edited.append(source.name)
        else:
            work.dress(thing, source, description, own[: len(thing.data.loops)])
            if torn[source.corner_start : source.corner_start + len(thing.data.loops)].any():
                torn_names.append(source.name)
    # Copies that are there already are renewed, or they would show an older result.
    copied = [one for one in made if copies or "copies" in one[1].get(BEFORE, {})]
    left = [one[0].name for one in made if one not in copied]
    edited += work.copy(copied)
    return sentences(
        (gone, "deleted or renamed since the capture, so no material went there"),
        (edited, "edited since the capture and left as it is; capture the scene again"),
        (locked, "linked from another file, so no material went there; make it local (Object, Relations, Make Local)"),
        (left, "modifiers or instances make the faces, so no material went there; write again with Make Copies on"),
        (torn_names, "faces that fold onto themselves show the texture of one part only"),
    )


def corners_of(polygons, atlas_uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Atlas coordinates of each corner of the faces, (c, 2) float32, and where triangles disagree on one, (c,) bool."""
    count = len(polygons.vertex)
    uv, torn = np.zeros((count, 2), np.float32), np.zeros(count, bool)
    where, values = polygons.corner.ravel(), np.ascontiguousarray(atlas_uv, np.float32).reshape(-1, 2)
    uv[where] = values
    torn[where[(np.abs(uv[where] - values) > 1e-6).any(1)]] = True
    return uv, torn


class _Work:
    """What dressing one object after the other needs to know."""

    def __init__(self, scene, folder: Path, base_color):
        self.scene, self.folder, self.base_color = scene, folder, base_color
        self.shown = Counter(thing.data for thing in bpy.data.objects if thing.type == "MESH")
        self.run = run_of(folder)

    def dress(self, thing: bpy.types.Object, source: Source, description: ObjectMaterial, uv: np.ndarray) -> None:
        """Put atlas coordinates ((c, 2) float32) and the material onto an object, keeping what it wore."""
        worn = [slot.material for slot in thing.material_slots]
        if BEFORE not in thing:
            before = {"slots": [{"material": old} if old else {} for old in worn]}
            if self.shown[thing.data] > 1 or thing.data.library or thing.data.override_library:
                before["mesh"] = thing.data
                thing.data = thing.data.copy()
            elif ATLAS_UV in thing.data.uv_layers:
                before["aside"] = True
                thing.data.uv_layers[ATLAS_UV].name = ASIDE
            thing[BEFORE] = before
        if set_layer(thing.data, ATLAS_UV, uv) is None:
            raise BadInputError(f"Object '{thing.name}' has no room for another UV map; take one away.")
        material = make_material(description, self.base_color)
        if not thing.material_slots:
            thing.data.materials.append(material)
        for slot in thing.material_slots:
            slot.material = material
        thing[OBJECT_ID] = source.object_id
        mark(thing, self.folder, self.run)
        drop_ours(worn)

    def copy(self, made: list[tuple]) -> list[str]:
        """Make the copies; names of objects that are no longer what was captured."""
        owners = {thing for _, thing, _, _ in made}
        for thing in owners:  # earlier copies go; what is read is the object itself
            undo_copies(thing)
        ordered = sorted(owners, key=lambda thing: thing.name)
        depsgraph = depsgraph_of(self.scene)
        parts = {(part.thing, part.name): part for part in gather(depsgraph, ordered)}
        changed, copies = [], {}
        for source, thing, description, uv in made:
            part = parts.get((thing, source.name))
            if part is None or part.topology != source.topology:
                changed.append(source.name)
                continue
            copy = self._frozen(part, source, depsgraph)
            self.dress(copy, source, description, uv[: len(copy.data.loops)])
            del copy[BEFORE]
            copy[COPY_OF] = thing
            copies.setdefault(thing, []).append(copy)
        for thing, ones in copies.items():
            thing[BEFORE] = {
                "copies": [{"copy": one} for one in ones],
                "hide_viewport": thing.hide_viewport,
                "hide_render": thing.hide_render,
            }
            thing.hide_viewport = thing.hide_render = True
        return changed

    def _frozen(self, part: Part, source: Source, depsgraph) -> bpy.types.Object:
        """An object that shows a part's faces as its own, in the collections of the artist's object."""
        thing, data = part.thing, None
        matrix = thing.evaluated_get(depsgraph).matrix_world.copy()
        if thing.type == "MESH" and len(part.pieces) == 1:  # with its own texture coordinates and all else
            data = bpy.data.meshes.new_from_object(
                thing.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
            )
            if topology_hash([faces_of(data)]) != part.topology:  # its one piece is an instance
                bpy.data.meshes.remove(data)
                data = None
        if data is None:
            data, matrix = part.mesh(), Matrix()
        elif ATLAS_UV in data.uv_layers:
            data.uv_layers.remove(data.uv_layers[ATLAS_UV])
        copy = bpy.data.objects.new(source.name + SUFFIX, data)
        copy.matrix_world = matrix
        for collection in thing.users_collection:
            collection.objects.link(copy)
        return copy


def restore(things: Iterable[bpy.types.Object]) -> tuple[int, tuple[str, ...]]:
    """Give objects back what they wore before the first `own_scene.write_back`.

    Parameters
    ----------
    things : iterable of bpy.types.Object
        Those that nothing was put onto are passed over; a copy stands for the object that it was made of.

    Returns
    -------
    count : int
        Objects that were given back.
    warnings : tuple of str
    """
    wanted = {(thing.get(COPY_OF) or thing): None for thing in things}
    count, edited, slots = 0, [], []
    for thing in wanted:
        before = thing.get(BEFORE)
        if before is None or thing.library:
            continue
        count += 1
        if "copies" in before:
            undo_copies(thing)
            continue
        worn = [slot.material for slot in thing.material_slots]
        if before.get("mesh") is not None:
            ours, thing.data = thing.data, before["mesh"]
            if not (same_topology(ours, thing.data) and np.array_equal(vertices_of(ours), vertices_of(thing.data))):
                edited.append(thing.name)
                ours.use_fake_user = True
            elif not ours.users:
                bpy.data.meshes.remove(ours)
        else:
            layers = thing.data.uv_layers
            if ATLAS_UV in layers:
                layers.remove(layers[ATLAS_UV])
            if "aside" in before and ASIDE in layers:
                layers[ASIDE].name = ATLAS_UV
        old = [one.get("material") for one in before.get("slots", ())]
        if not old and len(thing.material_slots) == 1:
            number = read(thing.data.polygons, "material_index", kind=np.int32)
            thing.data.materials.clear()
            if number.any():  # else an attribute would appear that was not there
                thing.data.polygons.foreach_set("material_index", number)
        elif len(old) != len(thing.material_slots):
            slots.append(thing.name)
        for slot, material in zip(thing.material_slots, old):
            slot.material = material
        for key in (BEFORE, RESULT, RUN, OBJECT_ID):
            if key in thing:
                del thing[key]
        drop_ours(worn)
    images.drop_unused({thing[RESULT] for thing in bpy.data.objects if RESULT in thing})
    return count, sentences(
        (edited, "edited since; the mesh from before is back, and the edited one is kept among the file's meshes"),
        (slots, "material slots were added or removed since; as many old materials as there are slots are back"),
    )


def wearing(things: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """Those that `restore` would change."""
    return [thing for thing in things if BEFORE in thing or COPY_OF in thing]


def undo_copies(thing: bpy.types.Object) -> None:
    """Take an object's copies away and show it again as it was."""
    before = thing.get(BEFORE)
    if before is None or "copies" not in before:
        return
    for one in before["copies"]:
        copy = one.get("copy")
        if copy is None:
            continue
        data, worn = copy.data, [slot.material for slot in copy.material_slots]
        bpy.data.objects.remove(copy)
        if not data.users:
            bpy.data.meshes.remove(data)
        drop_ours(worn)
    thing.hide_viewport, thing.hide_render = bool(before["hide_viewport"]), bool(before["hide_render"])
    del thing[BEFORE]


def drop_ours(materials: Iterable[bpy.types.Material | None]) -> None:
    """Remove those recovered materials that nothing wears any more."""
    for material in {one for one in materials if one is not None}:
        if MODEL in material and not material.users and not material.library:
            bpy.data.materials.remove(material)
