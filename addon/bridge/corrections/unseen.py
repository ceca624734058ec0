"""Spots that no frame saw: painted or filled on an image that is the artist's own.

It starts as a copy of the result's Base Color and lies in the .blend or beside it, never in the result folder, so that
no run writes over it. One image serves all objects that share an atlas; each object that shows it is marked.
"""

import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path

import bpy
import numpy as np
from mathutils import Color

from ...core.errors import BadInputError
from ...core.scene.atlas import Atlas
from ...core.scene.model import Mesh
from ...core.significance import LEVELS
from ..custom_properties import IMAGE, OBJECT_ID, PAINTED, RESULT, RUN
from ..data.arrays import layer_of, triangles_of, vertices_of
from ..data.images import DATA, array_image, image_array, load_image
from ..data.instances import chosen_in, slots_of
from ..data.materials import BASE_COLOR, principled
from ..data.mesh_objects import ATLAS_UV
from ..data.nodes import image_node
from ..refused import refused, sentences
from ..results import images
from ..scene.as_made import our_own
from .material import worn_material

_UV = "scan_relight_painted_uv"
"""Of an object: digest of the texture coordinates that its painted image was made for."""
_SOURCE = "scan_relight_painted_over"
"""Of a painted image: the result's image that it is a copy of."""
MASK = "unseen"


def texture_node(obj: bpy.types.Object, object_id: int | None = None) -> bpy.types.ShaderNode | None:
    """The node whose image the Base Color of an instance shows; None where it shows one colour.

    By default that of the object's active material slot, or else of another of its parts.
    """
    return next(_texture_nodes(obj, slots_of(obj) if object_id is None else [object_id]), None)


def _texture_nodes(obj: bpy.types.Object, instances: Iterable[int]) -> Iterator[bpy.types.ShaderNode]:
    """The texture nodes of instances of an object, that of its active material slot first."""
    for object_id in sorted(instances, key=lambda i: i != chosen_in(obj)):
        shader = principled(worn_material(obj, object_id))
        node = image_node(shader.inputs[BASE_COLOR]) if shader else None
        if node is not None:
            yield node


def painted(obj: bpy.types.Object) -> bpy.types.Image | None:
    """The artist's image that an object shows, or None."""
    return obj.get(PAINTED)


def own_image(obj: bpy.types.Object, where: str = images.PACK) -> bpy.types.Image:
    """The artist's image of an object; made where there is none yet, and shown.

    With `where` = `results.images.FOLDER` it is a file beside the saved .blend, else packed into it.

    Raises
    ------
    BadInputError
        The object has no texture, or one in tiles.
    StorageError
        The file can't be written.
    """
    node = texture_node(obj)
    if node is None:
        raise BadInputError(f"Object '{obj.name}' has one colour and no texture to paint; choose its colour instead.")
    if painted(obj) is not None:
        return painted(obj)
    source = node.image
    if source.source == "TILED":
        raise BadInputError(f"The colour of object '{obj.name}' lies in tiles; run with another atlas to paint it.")
    name, key = f"{source.name.removesuffix('.exr')} painted", path_of(source)
    copies = [copy for copy in bpy.data.images if copy.get(PAINTED) == key and not copy.library]
    image = next((copy for copy in copies if copy.size[:] == source.size[:]), None)
    if image is None:
        image = array_image(name, image_array(source))
        image[PAINTED], image[RUN] = key, obj.get(RUN, "")
        image.use_fake_user = True
        if where == images.FOLDER and bpy.data.filepath:
            _save_beside(image)
    elif image.get(RUN, "") != obj.get(RUN, ""):
        _renew(image, source, obj)  # what another run found of this object, which nobody painted
    image[_SOURCE] = source
    _show(obj, source, image)
    obj[PAINTED], obj[_UV] = image, _digest(obj.data)
    return image


def source_of(image: bpy.types.Image) -> bpy.types.Image:
    """The result's image that an artist's is a copy of; any other itself."""
    return image.get(_SOURCE) or image


def restore(objects: Iterable[bpy.types.Object], discard: bool = False) -> int:
    """Show what was found again; returns how many objects did not. `discard` also removes the paint from the image."""
    count = 0
    for obj in objects:
        image = painted(obj)
        if image is None:
            continue
        if discard and image.get(_SOURCE):
            _renew(image, image[_SOURCE], obj)
        if any(node.image == image for node in _texture_nodes(obj, slots_of(obj))):
            _show(obj, image, image.get(_SOURCE) or load_image(image[PAINTED]))
        for key in (PAINTED, _UV):
            del obj[key]
        count += 1
    return count


def reapply(obj: bpy.types.Object) -> list[str]:
    """Show what was painted again on an object whose mesh or material is new; warnings on what no longer fits."""
    image = painted(obj)
    if image is None:
        return []
    found = (node.image for node in _texture_nodes(obj, slots_of(obj)) if node.image != image)
    source = next((other for other in found if Path(path_of(other)).name == Path(image[PAINTED]).name), None)
    if source is None:
        return []
    if obj.get(_UV) != _digest(obj.data):
        return [
            f"What was painted on '{obj.name}' lies on other texture coordinates than this run's; it is kept as "
            f"image '{image.name}' and not shown."
        ]
    image[_SOURCE] = source
    _show(obj, source, image)
    return []


def _show(obj, earlier, image) -> None:
    """Have all parts of an object that show the image `earlier` show another one."""
    for object_id in slots_of(obj):
        node = texture_node(obj, object_id)
        if node is not None and node.image == earlier:
            with our_own(worn_material(obj, object_id)):
                node.image = image


def keep_painted() -> None:
    """Save unsaved paint into the packed images or files, as the .blend is about to be saved."""
    for image in bpy.data.images:
        if image.get(PAINTED) and image.is_dirty and not image.library:
            if image.packed_file:
                image.pack()
            else:
                image.save()


def unseen_mask(obj: bpy.types.Object) -> np.ndarray:
    """Mask of its atlas where no frame saw the surface, (h, w) bool, row 0 at the bottom; raises as `coverage`."""
    return coverage(obj)[..., 0] < 0.5


def coverage(obj: bpy.types.Object) -> np.ndarray:
    """The coverage over an object's atlas, (h, w, 3) float32, row 0 at the bottom; raises as `unseen_mask`."""
    node = texture_node(obj)
    if node is None:
        raise BadInputError(f"Object '{obj.name}' has one colour and no texture.")
    image = node.image
    base = Path(path_of(image))
    path = base.with_name(base.name.replace("base_color", "coverage"))
    if path == base or not path.is_file():
        raise BadInputError(f"'{path}' is missing, so nobody knows what no frame saw; run the recovery again.")
    from ...core.io.exr import read_exr  # not earlier, as all such: Blender's start should not wait for it

    values = np.array(read_exr(path).rgb)[::-1]
    if values.shape[:2] != (image.size[1], image.size[0]):
        raise BadInputError(f"'{path}' has another size than image '{image.name}'; restore the object first.")
    return values


def was_measured(origin: np.ndarray) -> np.ndarray:
    """Where the coverage's last number tells of a measured albedo, on faces that close holes too."""
    from ...core.passes.albedo.albedo import CLOSED, MEASURED

    return np.rint(origin).astype(int) % CLOSED == MEASURED


def stencil(obj: bpy.types.Object) -> bpy.types.Image:
    """A picture for Texture Paint's stencil mask: white, that is protected, where any frame saw the surface."""
    name = f"{painted(obj).name} {MASK}"
    if earlier := bpy.data.images.get(name):
        bpy.data.images.remove(earlier)
    return array_image(name, (~unseen_mask(obj)).astype(np.float32), DATA)


def paint(context: bpy.types.Context, obj: bpy.types.Object, where: str, colour, masked: bool = True) -> None:
    """Canvas, stencil mask and brush for the active object, then Blender's own Texture Paint.

    Parameters
    ----------
    where : str
        Where the canvas goes, see `own_image`; raises as that and `unseen_mask`.
    colour : (3,) of float or None
        Linear Rec.709: what the brush begins with.
    masked : bool
        Protect what any frame saw.
    """
    if masked:
        unseen_mask(obj)  # raises before anything is changed
    tools = context.scene.tool_settings
    settings = tools.image_paint
    settings.mode, settings.canvas = "IMAGE", own_image(obj, where)
    layers = obj.data.uv_layers
    layers.active = layers[ATLAS_UV]
    settings.use_stencil_layer = masked
    if masked:
        settings.stencil_image, settings.invert_stencil = stencil(obj), False
        obj.data.uv_layer_stencil = layers[ATLAS_UV]
    bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    unified = getattr(settings, "unified_paint_settings", None) or tools.unified_paint_settings
    brush = unified if unified.use_unified_color else settings.brush
    if colour and brush is not None:
        colour = Color(colour)
        gamma = brush.bl_rna.properties["color"].subtype == "COLOR_GAMMA"  # sRGB up to 4.5
        brush.color = [min(max(c, 0.0), 1.0) for c in (colour.from_scene_linear_to_srgb() if gamma else colour)]


def fill(objects: Iterable[bpy.types.Object], where: str = images.PACK) -> tuple[int, tuple[str, ...]]:
    """Fill what no frame saw of objects from the measured spots around, on the artist's image.

    Each spot becomes the mean of the `LEVELS.neighbours` measured ones of its object that lie nearest and face alike;
    what was seen stays as it is. Raises as `own_image` and `unseen_mask`; nothing is changed then.

    Returns
    -------
    count : int
        Texels that were filled.
    remarks : tuple of str
        Sentences on objects that were passed over.
    """
    groups: dict[str, list] = {}
    skipped: dict[str, list[str]] = {}
    for obj in objects:
        node = texture_node(obj)
        if node is None:
            skipped.setdefault("one colour, so there is nothing to fill", []).append(obj.name)
        else:
            groups.setdefault(path_of(node.image), []).append(obj)
    coverages = {path: coverage(members[0]) for path, members in groups.items()}
    count = sum(_fill(members, coverages[path], where, skipped) for path, members in groups.items())
    return count, sentences(*((names, why) for why, names in skipped.items()))


def _fill(objects, coverage_map, where, skipped) -> int:
    """`fill` for objects that show the same image, whose coverage is `coverage_map`."""
    from scipy.spatial import cKDTree

    owners, atlas = _elements(objects[0], coverage_map.shape[0])
    observed, quality = (coverage_map[..., k].ravel()[atlas.texel] for k in (0, 2))
    filled, value, spots = np.zeros(len(atlas), bool), np.empty((len(atlas), 3), np.float32), {}
    for obj in objects:
        elements = np.flatnonzero(atlas.object_id == owners.index(obj))
        unseen = elements[observed[elements] < 0.5]
        measured = elements[(observed[elements] >= 0.5) & was_measured(quality[elements])]
        if not len(unseen) or not len(measured):
            why = "frames saw all of it" if not len(unseen) else "no spot of it was measured to fill from"
            skipped.setdefault(why, []).append(obj.name)
            continue
        image = own_image(obj, where)  # of all of them before it is read, as each may renew its part
        spots[obj] = unseen, measured
    flat = image_array(image).reshape(coverage_map.shape[0] * coverage_map.shape[1], -1) if spots else None
    for unseen, measured in spots.values():
        neighbours = min(LEVELS.neighbours, len(measured))
        nearest = cKDTree(atlas.place(measured)).query(atlas.place(unseen), neighbours, workers=-1)
        distance, near = (values.reshape(len(unseen), -1) for values in nearest)
        weight = 1 / (distance**2 + atlas.texel_edge**2)
        value[unseen] = (weight[..., None] * flat[atlas.texel[measured], :3][near]).sum(1) / weight.sum(1)[:, None]
        filled[unseen] = True
    if spots:
        texels = np.flatnonzero(filled[atlas.padding])  # the gutter beside them too
        flat[texels, :3] = value[atlas.padding[texels]]
        _show_pixels(image, flat)
        if not image.packed_file:
            image.save()
    return int(filled.sum())


def room_of(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """All objects of a room in the scenes that show one of them."""
    candidates = dict.fromkeys(other for scene in obj.users_scene for other in scene.objects)
    return [other for other in candidates if OBJECT_ID in other and other.get(RESULT) == obj.get(RESULT)]


def _elements(obj: bpy.types.Object, size: int) -> tuple[list[bpy.types.Object], Atlas]:
    """The objects in the atlas of one, and its surface elements, whose `object_id` is the place among those objects."""
    from ...core.scene.elements import make_atlas

    objects = [other for other in room_of(obj) if other.type == "MESH" and ATLAS_UV in other.data.uv_layers]
    vertices, triangles, uv, object_ids, first = [], [], [], [], 0
    for k, owner in enumerate(objects):
        data = owner.data
        vertices.append(vertices_of(data, owner.matrix_world).astype(np.float32))
        triangles.append(triangles_of(data) + first)
        uv.append(layer_of(data, ATLAS_UV)[triangles_of(data, "loops")])
        object_ids.append(np.full(len(triangles[-1]), k, np.int32))
        first += len(data.vertices)
    mesh = Mesh(*map(np.concatenate, (vertices, triangles, object_ids)))
    return objects, make_atlas(mesh, np.concatenate(uv), size)


def _renew(image, source, obj) -> None:
    """Copy an object's texels from the result's image."""
    owners, atlas = _elements(obj, image.size[0])
    mask = atlas.object_id[atlas.padding] == owners.index(obj)
    pixels = image_array(image)
    pixels.reshape(-1, pixels.shape[2])[mask, :3] = image_array(source).reshape(len(mask), -1)[mask, :3]
    _show_pixels(image, pixels)


def _show_pixels(image, pixels) -> None:
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    if image.packed_file:
        image.pack()


def _save_beside(image) -> None:
    saved = Path(bpy.data.filepath)
    path = saved.parent / f"{saved.stem} images" / f"{bpy.path.clean_name(image.name)}.exr"
    with refused(f"'{path}' can't be written", "free some space or save the file elsewhere"):
        path.parent.mkdir(exist_ok=True)
        if image.packed_file:
            image.unpack(method="REMOVE")
        image.filepath_raw, image.file_format = str(path), "OPEN_EXR"
        image.save()


def path_of(image: bpy.types.Image) -> str:
    """Where an image of the result, or what an artist's is a copy of, came from."""
    image = source_of(image)  # as the result may have been moved since
    return str(image.get(PAINTED) or image.get(IMAGE) or bpy.path.abspath(image.filepath))


def _digest(data: bpy.types.Mesh) -> str:
    return hashlib.sha256(layer_of(data, ATLAS_UV).tobytes()).hexdigest()[:16]
