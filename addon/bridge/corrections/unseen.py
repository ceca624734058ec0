"""Spots that no frame saw: painted or filled on an image that is the artist's own.

It starts as a copy of the result's Base Color and lies in the .blend or beside it, never in the result folder, so that
no run writes over it. One image serves all objects that share an atlas; each object that shows it is marked.
"""

import hashlib
from collections.abc import Iterable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Color

from ...core.errors import BadInputError
from ...core.scene.atlas import Atlas
from ...core.scene.model import Mesh
from ...core.significance import LEVELS
from ..data.arrays import layer_of, triangles_of, vertices_of
from ..data.images import DATA, array_image, image_array, load_image
from ..data.materials import BASE_COLOR, principled
from ..data.mesh_objects import ATLAS_UV
from ..data.nodes import image_node
from ..marks import IMAGE, OBJECT_ID, PAINTED, RESULT, RUN
from ..refused import refused, sentences
from ..results import images
from ..scene.as_made import our_own
from .material import worn_material

_UV = "scan_relight_painted_uv"
"""Of an object: digest of the texture coordinates that its painted image was made for."""
_SOURCE = "scan_relight_painted_over"
"""Of a painted image: the result's image that it is a copy of."""
MASK = "unseen"


def texture_node(thing: bpy.types.Object) -> bpy.types.ShaderNode | None:
    """The node whose image an object's Base Color shows; None where it shows one colour."""
    shader = principled(worn_material(thing))
    return image_node(shader.inputs[BASE_COLOR]) if shader else None


def painted(thing: bpy.types.Object) -> bpy.types.Image | None:
    """The artist's image that an object shows, or None."""
    return thing.get(PAINTED)


def own_image(thing: bpy.types.Object, where: str = images.PACK) -> bpy.types.Image:
    """The artist's image of an object; made where there is none yet, and shown.

    Parameters
    ----------
    where : str
        `results.images.FOLDER`: a file beside the saved .blend; else packed into it.

    Raises
    ------
    BadInputError
        The object has no texture, or one in tiles.
    StorageError
        The file can't be written.
    """
    node = texture_node(thing)
    if node is None:
        raise BadInputError(f"Object '{thing.name}' has one colour and no texture to paint; choose its colour instead.")
    if painted(thing) is not None:
        return painted(thing)
    source = node.image
    if source.source == "TILED":
        raise BadInputError(f"The colour of object '{thing.name}' lies in tiles; run with another atlas to paint it.")
    name, key = f"{source.name.removesuffix('.exr')} painted", path_of(source)
    own = [one for one in bpy.data.images if one.get(PAINTED) == key and not one.library]
    image = next((one for one in own if one.size[:] == source.size[:]), None)
    if image is None:
        image = array_image(name, image_array(source))
        image[PAINTED], image[RUN] = key, thing.get(RUN, "")
        image.use_fake_user = True
        if where == images.FOLDER and bpy.data.filepath:
            _save_beside(image)
    elif image.get(RUN, "") != thing.get(RUN, ""):
        _renew(image, source, thing)  # what another run found of this object, which nobody painted
    image[_SOURCE] = source
    _show(thing, node, image)
    thing[PAINTED], thing[_UV] = image, _digest(thing.data)
    return image


def source_of(image: bpy.types.Image) -> bpy.types.Image:
    """The result's image that an artist's is a copy of; any other itself."""
    return image.get(_SOURCE) or image


def restore(things: Iterable[bpy.types.Object], discard: bool = False) -> int:
    """Let objects show what was found again; how many did not. Only `discard` takes it out of the image too."""
    count = 0
    for thing in things:
        image, node = painted(thing), texture_node(thing)
        if image is None:
            continue
        if discard and image.get(_SOURCE):
            _renew(image, image[_SOURCE], thing)
        if node is not None and node.image == image:
            _show(thing, node, image.get(_SOURCE) or load_image(image[PAINTED]))
        for key in (PAINTED, _UV):
            del thing[key]
        count += 1
    return count


def reapply(thing: bpy.types.Object) -> list[str]:
    """Show what was painted on an object again whose mesh or material is new; sentences on what no longer fits."""
    image, node = painted(thing), texture_node(thing)
    if image is None or node is None or node.image == image:
        return []
    if thing.get(_UV) != _digest(thing.data):
        return [
            f"What was painted on '{thing.name}' lies on other texture coordinates than this run's; it is kept as "
            f"image '{image.name}' and not shown."
        ]
    image[_SOURCE] = node.image
    _show(thing, node, image)
    return []


def _show(thing, node, image) -> None:
    with our_own(worn_material(thing)):
        node.image = image


def keep_painted() -> None:
    """Put what was painted since into the packed images or files, as the .blend is about to be saved."""
    for image in bpy.data.images:
        if image.get(PAINTED) and image.is_dirty and not image.library:
            if image.packed_file:
                image.pack()
            else:
                image.save()


def unseen_mask(thing: bpy.types.Object) -> np.ndarray:
    """Where in its atlas no frame saw the surface, (h, w) bool, row 0 at the bottom; raises as `coverage`."""
    return coverage(thing)[..., 0] < 0.5


def coverage(thing: bpy.types.Object) -> np.ndarray:
    """The coverage over an object's atlas, (h, w, 3) float32, row 0 at the bottom; raises as `unseen_mask`."""
    node = texture_node(thing)
    if node is None:
        raise BadInputError(f"Object '{thing.name}' has one colour and no texture.")
    image = node.image
    base = Path(path_of(image))
    path = base.with_name(base.name.replace("base_color", "coverage"))
    if path == base or not path.is_file():
        raise BadInputError(f"'{path}' is missing, so nobody knows what no frame saw; run the recovery again.")
    from ...core.io.exr import read_exr  # not earlier, as all such: Blender's start should not wait for it

    found = np.array(read_exr(path).rgb)[::-1]
    if found.shape[:2] != (image.size[1], image.size[0]):
        raise BadInputError(f"'{path}' has another size than image '{image.name}'; restore the object first.")
    return found


def was_measured(origin: np.ndarray) -> np.ndarray:
    """Where the coverage's last number tells of a measured albedo, on faces that close holes too."""
    from ...core.passes.albedo.albedo import CLOSED, MEASURED

    return np.rint(origin).astype(int) % CLOSED == MEASURED


def stencil(thing: bpy.types.Object) -> bpy.types.Image:
    """A picture for Texture Paint's stencil mask: white, that is protected, where any frame saw the surface."""
    name = f"{painted(thing).name} {MASK}"
    if earlier := bpy.data.images.get(name):
        bpy.data.images.remove(earlier)
    return array_image(name, (~unseen_mask(thing)).astype(np.float32), DATA)


def paint(context: bpy.types.Context, thing: bpy.types.Object, where: str, colour, masked: bool = True) -> None:
    """Canvas, stencil mask and brush for the active object, then Blender's own Texture Paint.

    Parameters
    ----------
    context : bpy.types.Context
        `thing` is its active object.
    where : str
        Where the canvas goes, see `own_image`.
    colour : (3,) of float or None
        Linear Rec.709: what the brush begins with.
    masked : bool
        Protect what any frame saw.

    Raises
    ------
    BadInputError, StorageError
        As of `own_image` and `unseen_mask`.
    """
    if masked:
        unseen_mask(thing)  # raises before anything is changed
    tools = context.scene.tool_settings
    settings = tools.image_paint
    settings.mode, settings.canvas = "IMAGE", own_image(thing, where)
    layers = thing.data.uv_layers
    layers.active = layers[ATLAS_UV]
    settings.use_stencil_layer = masked
    if masked:
        settings.stencil_image, settings.invert_stencil = stencil(thing), False
        thing.data.uv_layer_stencil = layers[ATLAS_UV]
    bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    unified = getattr(settings, "unified_paint_settings", None) or tools.unified_paint_settings
    brush = unified if unified.use_unified_color else settings.brush
    if colour and brush is not None:
        colour = Color(colour)
        gamma = brush.bl_rna.properties["color"].subtype == "COLOR_GAMMA"  # sRGB up to 4.5
        brush.color = [min(max(c, 0.0), 1.0) for c in (colour.from_scene_linear_to_srgb() if gamma else colour)]


def fill(things: Iterable[bpy.types.Object], where: str = images.PACK) -> tuple[int, list[str]]:
    """Fill what no frame saw of objects from the measured spots around, on the artist's image.

    Each spot becomes the mean of the `LEVELS.neighbours` measured ones of its object that lie nearest and face alike;
    what was seen stays as it is.

    Returns
    -------
    count : int
        Texels that were filled.
    remarks : list of str
        Sentences on objects that were passed over.

    Raises
    ------
    BadInputError, StorageError
        As of `own_image` and `unseen_mask`; nothing is changed then.
    """
    groups: dict[str, list] = {}
    passed: dict[str, list[str]] = {}
    for thing in things:
        node = texture_node(thing)
        if node is None:
            passed.setdefault("one colour, so there is nothing to fill", []).append(thing.name)
        else:
            groups.setdefault(path_of(node.image), []).append(thing)
    seen = {path: coverage(some[0]) for path, some in groups.items()}
    count = sum(_fill(some, seen[path], where, passed) for path, some in groups.items())
    return count, list(sentences(*((names, why) for why, names in passed.items())))


def _fill(things, seen, where, passed) -> int:
    """`fill` for objects that show the same image, whose coverage is `seen`."""
    from scipy.spatial import cKDTree

    owners = _sharing(things[0])
    atlas = _elements(owners, seen.shape[0])
    observed, quality = (seen[..., k].ravel()[atlas.texel] for k in (0, 2))
    number = {thing: k for k, thing in enumerate(owners)}
    filled, value, spots = np.zeros(len(atlas), bool), np.empty((len(atlas), 3), np.float32), {}
    for thing in things:
        own = np.flatnonzero(atlas.object_id == number[thing])
        wanted, measured = own[observed[own] < 0.5], own[(observed[own] >= 0.5) & was_measured(quality[own])]
        if not len(wanted) or not len(measured):
            why = "frames saw all of it" if not len(wanted) else "no spot of it was measured to fill from"
            passed.setdefault(why, []).append(thing.name)
            continue
        image = own_image(thing, where)  # of all of them before it is read, as each may renew its part
        spots[thing] = wanted, measured
    flat = image_array(image).reshape(seen.shape[0] * seen.shape[1], -1) if spots else None
    for wanted, measured in spots.values():
        tree, nearest = cKDTree(atlas.place(measured)), min(LEVELS.neighbours, len(measured))
        distance, near = (
            found.reshape(len(wanted), -1) for found in tree.query(atlas.place(wanted), nearest, workers=-1)
        )
        weight = 1 / (distance**2 + atlas.texel_edge**2)
        value[wanted] = (weight[..., None] * flat[atlas.texel[measured], :3][near]).sum(1) / weight.sum(1)[:, None]
        filled[wanted] = True
    if spots:
        texels = np.flatnonzero(filled[atlas.padding])  # the gutter beside them too
        flat[texels, :3] = value[atlas.padding[texels]]
        _show_pixels(image, flat)
        if not image.packed_file:
            image.save()
    return int(filled.sum())


def room_of(thing: bpy.types.Object) -> list[bpy.types.Object]:
    """All objects of a room in the scenes that show one of them."""
    everything = dict.fromkeys(one for scene in thing.users_scene for one in scene.objects)
    return [one for one in everything if OBJECT_ID in one and one.get(RESULT) == thing.get(RESULT)]


def _sharing(thing: bpy.types.Object) -> list[bpy.types.Object]:
    """All objects of the room whose texture coordinates lie in the same atlas."""
    return [one for one in room_of(thing) if one.type == "MESH" and ATLAS_UV in one.data.uv_layers]


def _elements(things: list[bpy.types.Object], size: int) -> Atlas:
    from ...core.scene.elements import make_atlas

    vertices, triangles, uv, number, first = [], [], [], [], 0
    for k, thing in enumerate(things):
        data = thing.data
        vertices.append(vertices_of(data, thing.matrix_world).astype(np.float32))
        triangles.append(triangles_of(data) + first)
        uv.append(layer_of(data, ATLAS_UV)[triangles_of(data, "loops")])
        number.append(np.full(len(triangles[-1]), k, np.int32))
        first += len(data.vertices)
    return make_atlas(Mesh(*map(np.concatenate, (vertices, triangles, number))), np.concatenate(uv), size)


def _renew(image, source, thing) -> None:
    """Copy an object's texels from the result's image."""
    owners = _sharing(thing)
    atlas = _elements(owners, image.size[0])
    own = atlas.object_id[atlas.padding] == owners.index(thing)
    pixels = image_array(image)
    pixels.reshape(-1, pixels.shape[2])[own, :3] = image_array(source).reshape(len(own), -1)[own, :3]
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
        image.unpack(method="REMOVE") if image.packed_file else None
        image.filepath_raw, image.file_format = str(path), "OPEN_EXR"
        image.save()


def path_of(image: bpy.types.Image) -> str:
    """Where an image of the result, or what an artist's is a copy of, came from."""
    image = source_of(image)  # as the result may have been moved since
    return str(image.get(PAINTED) or image.get(IMAGE) or bpy.path.abspath(image.filepath))


def _digest(data: bpy.types.Mesh) -> str:
    return hashlib.sha256(layer_of(data, ATLAS_UV).tobytes()).hexdigest()[:16]
