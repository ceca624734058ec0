"""Recovered materials onto the artist's own objects, and the original ones restored.

Every slot of an object gets the recovered material, so its faces' material indices stay as they are. The original
materials are stored on the object as pointers to the data-blocks, which survive renaming, saving and loading. A mesh
that several objects share is copied for each, as each has its own part of the atlas; the shared one is stored likewise.
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
from ..custom_properties import OBJECT_ID, RESULT, RUN, set_run
from ..data.arrays import faces_of, read, set_layer, vertices_of
from ..data.materials import MODEL, make_material
from ..data.mesh_objects import ATLAS_UV
from ..light.room import depsgraph_of
from ..refused import sentences
from ..results import images
from .capture import Source, check_own, polygons_of, sources
from .mesh import Part, gather, same_topology, topology_hash

BEFORE = "scan_relight_before"
"""Custom property of an object: its original materials, mesh or copies."""
COPY_OF = "scan_relight_copy_of"
"""Custom property of a copy: the object that it was made of."""
PREVIOUS_UV = "ScanRelight before"
"""New name of a UV map that already had the name of ours."""
AUTO, IMPORTED, SELECTED = "AUTO", "IMPORTED", "SELECTED"
"""Objects that get the materials: those the capture was made of; the imported ones; the artist's own."""
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
    """Put the recovered materials onto the objects that a capture was made of, one object at a time.

    It yields the share done, so that the window can be redrawn.

    Parameters
    ----------
    capture : Capture
        Made by `capture_scene`.
    atlas_uv : (t, 3, 2) float32
    where : str
        Where the images go: see `results.images`.
    copies : bool
        Make a copy, with modifiers applied, of each object whose faces come from modifiers or instances, and hide
        the object itself; without it such objects are left as they are.

    Returns
    -------
    tuple of str
        Warnings, one sentence each.

    Raises
    ------
    MissingStageError
        The capture was not made of a scene.
    BadInputError
        An image can't be read, or there is no folder for the images.
    """
    captured, polygons = sources(capture.root), polygons_of(capture.root, capture.mesh)
    check_own(capture.root)
    if polygons is None:
        raise MissingStageError(f"Capture '{capture.root}' is damaged; capture the scene again.")
    base_color = images.load_baked(result_folder, where)
    corner_uv, torn = corner_uvs(polygons, atlas_uv)
    descriptions = {material.object_id: material for material in materials}
    assignment = _Assignment(scene, Path(result_folder).absolute(), base_color)
    missing, edited, generated, linked, torn_names = [], [], [], [], []
    for done, source in enumerate(captured):
        yield done / len(captured)
        obj = scene.objects.get(source.thing)
        if obj is None:
            missing.append(source.name)
            continue
        if obj.library or obj.override_library:
            linked.append(source.name)
            continue
        description = descriptions.get(source.object_id) or undescribed(source.object_id, source.name)
        object_uv = corner_uv[source.corner_start :]
        if not source.own:
            generated.append((source, obj, description, object_uv))
        elif obj.type != "MESH" or topology_hash([faces_of(obj.data)]) != source.topology:
            edited.append(source.name)
        else:
            assignment.assign(obj, source, description, object_uv[: len(obj.data.loops)])
            if torn[source.corner_start : source.corner_start + len(obj.data.loops)].any():
                torn_names.append(source.name)
    # Copies that are there already are renewed, or they would show an older result.
    to_copy = [item for item in generated if copies or "copies" in item[1].get(BEFORE, {})]
    skipped = [item[0].name for item in generated if item not in to_copy]
    edited += assignment.copy(to_copy)
    return sentences(
        (missing, "deleted or renamed since the capture, so no material went there"),
        (edited, "edited since the capture and left as it is; capture the scene again"),
        (linked, "linked from another file, so no material went there; make it local (Object, Relations, Make Local)"),
        (skipped, "modifiers or instances make the faces, so no material went there; write again with Make Copies on"),
        (torn_names, "faces that fold onto themselves show the texture of one part only"),
    )


def corner_uvs(polygons, atlas_uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Atlas coordinates of each corner of the faces, (c, 2) float32, and where triangles disagree on one, (c,) bool."""
    count = len(polygons.vertex)
    uv, torn = np.zeros((count, 2), np.float32), np.zeros(count, bool)
    indices, values = polygons.corner.ravel(), np.ascontiguousarray(atlas_uv, np.float32).reshape(-1, 2)
    uv[indices] = values
    torn[indices[(np.abs(uv[indices] - values) > 1e-6).any(1)]] = True
    return uv, torn


class _Assignment:
    """Assigns the recovered materials to one object after the other."""

    def __init__(self, scene, folder: Path, base_color):
        self.scene, self.folder, self.base_color = scene, folder, base_color
        self.mesh_users = Counter(obj.data for obj in bpy.data.objects if obj.type == "MESH")
        self.run = run_of(folder)

    def assign(self, obj: bpy.types.Object, source: Source, description: ObjectMaterial, uv: np.ndarray) -> None:
        """Give an object atlas coordinates ((c, 2) float32) and the material; its original materials are stored."""
        old_materials = [slot.material for slot in obj.material_slots]
        if BEFORE not in obj:
            backup = {"slots": [{"material": material} if material else {} for material in old_materials]}
            if self.mesh_users[obj.data] > 1 or obj.data.library or obj.data.override_library:
                backup["mesh"] = obj.data
                obj.data = obj.data.copy()
            elif ATLAS_UV in obj.data.uv_layers:
                backup["aside"] = True
                obj.data.uv_layers[ATLAS_UV].name = PREVIOUS_UV
            obj[BEFORE] = backup
        if set_layer(obj.data, ATLAS_UV, uv) is None:
            raise BadInputError(f"Object '{obj.name}' has no room for another UV map; take one away.")
        material = make_material(description, self.base_color)
        if not obj.material_slots:
            obj.data.materials.append(material)
        for slot in obj.material_slots:
            slot.material = material
        obj[OBJECT_ID] = source.object_id
        set_run(obj, self.folder, self.run)
        remove_unused_materials(old_materials)

    def copy(self, generated: list[tuple]) -> list[str]:
        """Make the copies; returns the names of objects that have changed since the capture."""
        owners = {obj for _, obj, _, _ in generated}
        for obj in owners:  # earlier copies are removed; the object itself is read
            remove_copies(obj)
        ordered = sorted(owners, key=lambda obj: obj.name)
        depsgraph = depsgraph_of(self.scene)
        parts = {(part.obj, part.name): part for part in gather(depsgraph, ordered)}
        changed, copies = [], {}
        for source, obj, description, uv in generated:
            part = parts.get((obj, source.name))
            if part is None or part.topology != source.topology:
                changed.append(source.name)
                continue
            copy = self._evaluated_copy(part, source, depsgraph)
            self.assign(copy, source, description, uv[: len(copy.data.loops)])
            del copy[BEFORE]
            copy[COPY_OF] = obj
            copies.setdefault(obj, []).append(copy)
        for obj, new_copies in copies.items():
            obj[BEFORE] = {
                "copies": [{"copy": copy} for copy in new_copies],
                "hide_viewport": obj.hide_viewport,
                "hide_render": obj.hide_render,
            }
            obj.hide_viewport = obj.hide_render = True
        return changed

    def _evaluated_copy(self, part: Part, source: Source, depsgraph) -> bpy.types.Object:
        """A new object with a part's evaluated faces as its mesh, in the collections of the artist's object."""
        obj, data = part.obj, None
        matrix = obj.evaluated_get(depsgraph).matrix_world.copy()
        if obj.type == "MESH" and len(part.pieces) == 1:  # with its own UV maps and all other layers
            data = bpy.data.meshes.new_from_object(
                obj.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
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
        for collection in obj.users_collection:
            collection.objects.link(copy)
        return copy


def restore(objects: Iterable[bpy.types.Object]) -> tuple[int, tuple[str, ...]]:
    """Give objects their original materials back, as before the first `own_scene.write_back`.

    Parameters
    ----------
    objects : iterable of bpy.types.Object
        Those without recovered materials are skipped; a copy stands for the object that it was made of.

    Returns
    -------
    count : int
        Objects that were restored.
    warnings : tuple of str
    """
    originals = {(obj.get(COPY_OF) or obj): None for obj in objects}
    count, edited, changed_slots = 0, [], []
    for obj in originals:
        backup = obj.get(BEFORE)
        if backup is None or obj.library:
            continue
        count += 1
        if "copies" in backup:
            remove_copies(obj)
            continue
        current_materials = [slot.material for slot in obj.material_slots]
        if backup.get("mesh") is not None:
            mesh, obj.data = obj.data, backup["mesh"]
            if not (same_topology(mesh, obj.data) and np.array_equal(vertices_of(mesh), vertices_of(obj.data))):
                edited.append(obj.name)
                mesh.use_fake_user = True
            elif not mesh.users:
                bpy.data.meshes.remove(mesh)
        else:
            layers = obj.data.uv_layers
            if ATLAS_UV in layers:
                layers.remove(layers[ATLAS_UV])
            if "aside" in backup and PREVIOUS_UV in layers:
                layers[PREVIOUS_UV].name = ATLAS_UV
        old_materials = [slot_entry.get("material") for slot_entry in backup.get("slots", ())]
        if not old_materials and len(obj.material_slots) == 1:
            slot_indices = read(obj.data.polygons, "material_index", kind=np.int32)
            obj.data.materials.clear()
            if slot_indices.any():  # else an attribute would appear that was not there
                obj.data.polygons.foreach_set("material_index", slot_indices)
        elif len(old_materials) != len(obj.material_slots):
            changed_slots.append(obj.name)
        for slot, material in zip(obj.material_slots, old_materials):
            slot.material = material
        for key in (BEFORE, RESULT, RUN, OBJECT_ID):
            if key in obj:
                del obj[key]
        remove_unused_materials(current_materials)
    images.drop_unused({obj[RESULT] for obj in bpy.data.objects if RESULT in obj})
    return count, sentences(
        (edited, "edited since; the mesh from before is back, and the edited one is kept among the file's meshes"),
        (
            changed_slots,
            "material slots were added or removed since; as many old materials as there are slots are back",
        ),
    )


def restorable(objects: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """Those that `restore` would change."""
    return [obj for obj in objects if BEFORE in obj or COPY_OF in obj]


def remove_copies(obj: bpy.types.Object) -> None:
    """Remove an object's copies and restore its visibility."""
    backup = obj.get(BEFORE)
    if backup is None or "copies" not in backup:
        return
    for entry in backup["copies"]:
        copy = entry.get("copy")
        if copy is None:
            continue
        data, copy_materials = copy.data, [slot.material for slot in copy.material_slots]
        bpy.data.objects.remove(copy)
        if not data.users:
            bpy.data.meshes.remove(data)
        remove_unused_materials(copy_materials)
    obj.hide_viewport, obj.hide_render = bool(backup["hide_viewport"]), bool(backup["hide_render"])
    del obj[BEFORE]


def remove_unused_materials(materials: Iterable[bpy.types.Material | None]) -> None:
    """Remove those recovered materials that nothing uses any more."""
    for material in {material for material in materials if material is not None}:
        if MODEL in material and not material.users and not material.library:
            bpy.data.materials.remove(material)
