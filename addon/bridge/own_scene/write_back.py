"""Recovered materials onto the artist's own objects; `restore.py` brings the original ones back.

Every slot of an object gets the recovered material, or each used slot its own, so its faces' material indices stay as
they are. Only where face sets tell the parts, or a copy of evaluated faces is written, each part gets a slot, and its
faces that index. The original materials are stored on the object as pointers to the data-blocks, which survive
renaming, saving and loading. A mesh that several objects share is copied for each, as each has its own part of the
atlas; the shared one is stored likewise.
"""

from collections import Counter
from collections.abc import Generator, Iterable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...core.brdf.material import ObjectMaterial, undescribed
from ...core.errors import BadInputError, MissingStageError
from ...core.results.room_file import run_of
from ...core.scene.model import Capture, Instance
from ..custom_properties import BEFORE, OBJECT_ID, set_run
from ..data.arrays import faces_of, read, set_layer
from ..data.materials import make_material
from ..data.mesh_objects import ATLAS_UV, by_object
from ..data.unwrap import Polygons
from ..light.room import depsgraph_of
from ..refused import sentences
from ..results import images
from .capture import Source, check_own, polygons_of, sources
from .mesh import SceneObject, gather, topology_hash
from .restore import COPY_OF, PREVIOUS_SLOT, PREVIOUS_UV, remove_copies, remove_unused_materials

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
    """Put the recovered materials onto the objects that a capture was made of, one by one; yields the share done.

    Parameters
    ----------
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
    MissingStageError, BadInputError
        The capture was not made of a scene; an image can't be read, or there is no folder for the images.
    """
    captured, polygons = sources(capture.root), polygons_of(capture.root, capture.mesh)
    check_own(capture.root)
    if polygons is None:
        raise MissingStageError(f"Capture '{capture.root}' is damaged; capture the scene again.")
    base_color = images.load_baked(result_folder, where)
    corner_uv, torn = corner_uvs(polygons, atlas_uv)
    descriptions = {material.object_id: material for material in materials}
    slots = {source.object_id: source.slot for source in captured}
    instances = by_object(capture.mesh, capture.instances)
    assignment = _Assignment(scene, Path(result_folder).absolute(), base_color)
    missing, edited, generated, linked, torn_names = [], [], [], [], []
    for done, source in enumerate(captured):
        yield done / len(captured)
        if source.part_of is not None:  # written with its whole
            continue
        obj = scene.objects.get(source.thing)
        if obj is None:
            missing.append(source.whole)
            continue
        if obj.library or obj.override_library:
            linked.append(source.whole)
            continue
        found = instances.get(source.object_id, [])
        parts = _parts(source, found, slots, capture.mesh.object_id, polygons, descriptions)
        object_uv = corner_uv[source.corner_start :]
        if not source.own:
            generated.append((source, obj, parts, object_uv))
        elif obj.type != "MESH" or topology_hash([faces_of(obj.data)]) != source.topology:
            edited.append(source.whole)
        else:
            assignment.back_up(obj, parts)
            assignment.assign(obj, parts, object_uv[: len(obj.data.loops)])
            if torn[source.corner_start : source.corner_start + len(obj.data.loops)].any():
                torn_names.append(source.whole)
    # Copies that are there already are renewed, or they would show an older result.
    to_copy = [item for item in generated if copies or "copies" in item[1].get(BEFORE, {})]
    skipped = [item[0].whole for item in generated if item not in to_copy]
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


@dataclass(frozen=True)
class _Parts:
    """What an object is to wear.

    Attributes
    ----------
    materials : list of ObjectMaterial
        The main part's first.
    slots : list of int or None
        Slot of each of these; None where each gets a slot by the faces' `part`.
    part : (f,) int32
        Index in `materials` of each face.
    """

    materials: list[ObjectMaterial]
    slots: list[int] | None
    part: np.ndarray

    @property
    def by_faces(self) -> bool:
        """Whether writing changes the faces' material indices."""
        return len(self.materials) > 1 and self.slots is None


def _parts(
    main: Source,
    instances: list[Instance],
    slot_of: dict,
    object_id: np.ndarray,
    polygons: Polygons,
    descriptions: dict,
) -> _Parts:
    """The parts of the object whose main part is `main`: as captured, and those that the run itself has found."""
    names = {main.object_id: main.name} | {instance.object_id: instance.name for instance in instances}
    materials = [descriptions.get(i) or undescribed(i, name) for i, name in names.items()]
    slots = [slot_of.get(i) for i in names]
    # Faces without a triangle show nothing; they stay with the main part.
    first = int(np.searchsorted(polygons.start, main.corner_start))
    part = np.zeros(len(polygons.start) - 1 - first, np.int32)
    for index, i in enumerate(names):
        part[polygons.face[object_id == i] - first] = index
    return _Parts(materials, slots if main.own and None not in slots else None, part)


class _Assignment:
    """Assigns the recovered materials to one object after the other."""

    def __init__(self, scene, folder: Path, base_color):
        self.scene, self.folder, self.base_color = scene, folder, base_color
        self.mesh_users = Counter(obj.data for obj in bpy.data.objects if obj.type == "MESH")
        self.run = run_of(folder)

    def back_up(self, obj: bpy.types.Object, parts: _Parts) -> None:
        """Store an object's original materials and slots, unless they are already, and give it a mesh of its own."""
        if BEFORE not in obj:
            backup = {"slots": [{"material": slot.material} if slot.material else {} for slot in obj.material_slots]}
            if self.mesh_users[obj.data] > 1 or obj.data.library or obj.data.override_library:
                backup["mesh"] = obj.data
                obj.data = obj.data.copy()
            elif ATLAS_UV in obj.data.uv_layers:
                backup["aside"] = True
                obj.data.uv_layers[ATLAS_UV].name = PREVIOUS_UV
            obj[BEFORE] = backup
        if parts.by_faces and "faces" not in obj[BEFORE]:
            obj[BEFORE]["faces"] = True
            if "material_index" in obj.data.attributes:
                before = obj.data.attributes.new(PREVIOUS_SLOT, "INT", "FACE")
                before.data.foreach_set("value", read(obj.data.polygons, "material_index", kind=np.int32))

    def assign(self, obj: bpy.types.Object, parts: _Parts, uv: np.ndarray) -> None:
        """Give an object atlas coordinates ((c, 2) float32) and its parts' materials."""
        old_materials = [slot.material for slot in obj.material_slots]
        if set_layer(obj.data, ATLAS_UV, uv) is None:
            raise BadInputError(f"Object '{obj.name}' has no room for another UV map; take one away.")
        materials = [make_material(description, self.base_color) for description in parts.materials]
        for description, material in zip(parts.materials[1:], materials[1:]):
            material[OBJECT_ID] = description.object_id
        if len(materials) == 1:
            slots = range(max(len(obj.material_slots), 1))
            materials *= len(slots)
        else:
            slots = range(len(materials)) if parts.slots is None else parts.slots
        while len(obj.material_slots) <= max(slots):
            obj.data.materials.append(None)
        for slot, material in zip(slots, materials, strict=True):
            obj.material_slots[slot].material = material
        if parts.by_faces:
            obj.data.polygons.foreach_set("material_index", parts.part[: len(obj.data.polygons)])
        obj[OBJECT_ID] = parts.materials[0].object_id
        set_run(obj, self.folder, self.run)
        remove_unused_materials(old_materials)

    def copy(self, generated: list[tuple]) -> list[str]:
        """Make the copies; returns the names of objects that have changed since the capture."""
        owners = {obj for _, obj, *_ in generated}
        for obj in owners:  # earlier copies are removed; the object itself is read
            remove_copies(obj)
        ordered = sorted(owners, key=lambda obj: obj.name)
        depsgraph = depsgraph_of(self.scene)
        now = {(entry.obj, entry.topology, entry.name): entry for entry in gather(depsgraph, ordered)}
        changed, copies = [], {}
        for source, obj, parts, uv in generated:
            scene_object = now.get((obj, source.topology, source.whole))
            if scene_object is None:
                changed.append(source.whole)
                continue
            copy = self._evaluated_copy(scene_object, depsgraph)
            self.assign(copy, parts, uv[: len(copy.data.loops)])
            copy[COPY_OF] = obj
            copies.setdefault(obj, []).append(copy)
        for obj, new_copies in copies.items():
            hidden = {"hide_viewport": obj.hide_viewport, "hide_render": obj.hide_render}
            obj[BEFORE] = {"copies": [{"copy": copy} for copy in new_copies], **hidden}
            obj.hide_viewport = obj.hide_render = True
        return changed

    def _evaluated_copy(self, scene_object: SceneObject, depsgraph) -> bpy.types.Object:
        """A new object with evaluated faces as its mesh, in the collections of the artist's object."""
        obj, data = scene_object.obj, None
        evaluated = obj.evaluated_get(depsgraph)
        matrix = evaluated.matrix_world.copy()
        if obj.type == "MESH" and len(scene_object.pieces) == 1:  # with its own UV maps and all other layers
            data = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=depsgraph)
            if topology_hash([faces_of(data)]) != scene_object.topology:  # its one piece is an instance
                bpy.data.meshes.remove(data)
                data = None
        if data is None:
            data, matrix = scene_object.mesh(), Matrix()
        elif ATLAS_UV in data.uv_layers:
            data.uv_layers.remove(data.uv_layers[ATLAS_UV])
        copy = bpy.data.objects.new(scene_object.name + SUFFIX, data)
        copy.matrix_world = matrix
        for collection in obj.users_collection:
            collection.objects.link(copy)
        return copy
