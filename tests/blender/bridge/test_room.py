"""The room in the open file: the same picture as scene.blend, one room after many runs, the artist's work kept."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Matrix, Vector  # noqa: E402

from addon.bridge.data.cameras import frame_cameras  # noqa: E402
from addon.bridge.job.run import run  # noqa: E402
from addon.bridge.light import lamps, outside  # noqa: E402
from addon.bridge.relight.lights import add_light  # noqa: E402
from addon.bridge.relight.match_frame import match_frame  # noqa: E402
from addon.bridge.results import changes  # noqa: E402
from addon.bridge.room.bring import bringing, link_room, rooms  # noqa: E402
from addon.bridge.room.scanned import importing  # noqa: E402
from addon.bridge.slices import whole  # noqa: E402
from addon.core.errors import BadInputError, MissingStageError  # noqa: E402
from addon.core.io.read import read_capture  # noqa: E402
from addon.core.progress import Progress  # noqa: E402
from addon.core.settings import Settings  # noqa: E402

COARSE = Settings(shading_rays=16, specular_rays=4, emitter_rays=2, refine=0, texel_size=0.12, atlas_size=512)
KINDS = ("scenes", "collections", "objects", "meshes", "cameras", "materials", "worlds", "images", "actions")


@pytest.fixture(scope="module")
def first(tmp_path_factory, tiny_capture):
    """The result of a coarse run."""
    folder = tmp_path_factory.mktemp("first") / "result"
    run(tiny_capture, folder, COARSE, Progress())
    return folder


@pytest.fixture(scope="module")
def second(tmp_path_factory, tiny_capture):
    """The result of another run: other texels, so another atlas, and another mesh."""
    folder = tmp_path_factory.mktemp("second") / "result"
    run(tiny_capture, folder, replace(COARSE, texel_size=0.08, denoise_mesh=False), Progress())
    return folder


@pytest.fixture
def artist():
    """The startup file's scene: cube, camera, light, grey world."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    return bpy.context.scene


def bring(folder, *more, **how):
    return whole(bringing(folder, *more, **how))


def counts():
    return {kind: len(getattr(bpy.data, kind)) for kind in KINDS}


def named(scene, text):
    """The one scanned object whose name begins with `text`."""
    [thing] = [thing for thing in scene.objects if "object_id" in thing and thing.name.startswith(text)]
    return thing


def principled(thing):
    return next(node for node in thing.data.materials[0].node_tree.nodes if node.type == "BSDF_PRINCIPLED")


def shape_in_world(thing):
    """Corners of the mesh, as it stands (basis: the scene may never have been evaluated), sorted."""
    places = np.array([thing.matrix_basis @ vertex.co for vertex in thing.data.vertices])
    return places[np.lexsort(places.round(4).T)]


def render(scene, path, camera_name):
    scene.camera = next(thing for thing in frame_cameras(scene) if thing.name.startswith(camera_name))
    scene.cycles.device, scene.cycles.seed, scene.cycles.samples = "CPU", 3, 64
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True, scene=scene.name)
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels[:], np.float32).reshape(image.size[1], image.size[0], 4)[..., :3]
    return pixels * 2**scene.view_settings.exposure


def psnr(one, other):
    """Of pictures as shown: under their exposure, with the curve of a screen."""
    shown = [picture.clip(0, 1) ** (1 / 2.2) for picture in (one, other)]
    return -10 * np.log10(max(np.mean((shown[0] - shown[1]) ** 2), 1e-12))


def state_of(scene):
    """What an artist would notice of a scene."""
    world = scene.world
    return (
        scene.render.engine,
        scene.view_settings.exposure,
        scene.camera,
        world,
        tuple(world.node_tree.nodes["Background"].inputs["Color"].default_value),
        scene.render.resolution_x,
        scene.frame_end,
        sorted(thing.name for thing in scene.objects),
    )


@pytest.mark.slow
def test_the_windows_room_renders_as_scene_blend(first, artist, tmp_path):
    """Another scene, file and way, the same picture: world, exposure, lamps, mesh and images are the same."""
    before = state_of(artist)
    brought = bring(first)
    assert state_of(artist) == before
    here = render(brought.scene, tmp_path / "here.exr", "frame_0001")
    materials = [slot.material for thing in brought.scene.objects for slot in thing.material_slots]
    one_sided = sum(any(node.type == "NEW_GEOMETRY" for node in one.node_tree.nodes) for one in materials)
    exposure, engine = brought.scene.view_settings.exposure, brought.scene.render.engine
    bpy.ops.wm.open_mainfile(filepath=str(first / "scene.blend"))
    opened = bpy.context.scene
    there = render(opened, tmp_path / "there.exr", "frame_0001")
    assert here.max() > 0.05
    assert psnr(here, there) > 45
    assert (exposure, engine) == (opened.view_settings.exposure, "CYCLES") and exposure != 0
    assert one_sided == sum(
        any(node.type == "NEW_GEOMETRY" for node in slot.material.node_tree.nodes)
        for thing in opened.objects
        for slot in thing.material_slots
    )


def test_the_room_has_a_scene_of_its_own(first, artist, tiny_capture):
    brought = bring(first)
    scene = brought.scene
    assert scene.name == f"Scan Relight: {tiny_capture.name}" and scene["scan_relight_own"]
    assert rooms(scene) == [brought.collection] and not rooms(artist)
    assert brought.collection["scan_relight_capture"] == str(tiny_capture)
    assert brought.collection["scan_relight_result"] == str(first)
    assert scene.camera in frame_cameras(scene) and scene.world.node_tree.nodes["Background"]
    shown = next(image for image in bpy.data.images if image.filepath.endswith("base_color.exr"))
    assert bpy.path.abspath(shown.filepath) == str(first / "base_color.exr")


def test_into_the_artists_scene_only_the_room_comes(first, artist):
    before = state_of(artist)
    assert bring(first, artist).scene == artist
    assert state_of(artist)[:-1] == before[:-1] and len(rooms(artist)) == 1
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"] and len(bpy.data.worlds) == 1


def test_a_room_can_be_linked_with_its_light(first, artist):
    brought = bring(first)
    link_room(brought.collection, artist)
    link_room(brought.collection, artist)
    assert rooms(artist) == [brought.collection] and artist.world != brought.scene.world
    link_room(brought.collection, artist, outside=brought.scene)
    assert artist.world == brought.scene.world
    assert artist.view_settings.exposure == brought.scene.view_settings.exposure


@pytest.mark.slow
def test_running_twice_gives_one_room(first, second, artist):
    once = {}
    for folder in (first, second, first, first, second):
        bring(folder)
        assert counts() == once.setdefault(folder, counts())
    assert {kind: once[first][kind] for kind in KINDS if kind != "materials"} == {
        kind: once[second][kind] for kind in KINDS if kind != "materials"
    }  # the second run may set other parts of objects apart, each of a material of its own
    for kind in ("objects", "meshes", "materials", "images", "worlds", "collections", "actions"):
        assert not [one.name for one in getattr(bpy.data, kind) if one.name[-4:-3] == "."], kind


def test_the_second_result_is_shown(first, second, artist):
    """Meshes, images and marks are those of the run before last no more."""
    kept = {thing["object_id"]: thing for thing in bring(first).collection.all_objects if "object_id" in thing}
    brought = bring(second)
    things = {thing["object_id"]: thing for thing in brought.collection.all_objects if "object_id" in thing}
    assert things == kept  # the same objects
    with bpy.data.libraries.load(str(second / "scene.blend"), link=False) as (there, wanted):
        wanted.objects = [name for name in there.objects if name.startswith("ball ")]
    np.testing.assert_allclose(
        shape_in_world(named(brought.scene, "ball ")), shape_in_world(wanted.objects[0]), atol=1e-5
    )
    assert all(thing["scan_relight_result"] == str(second) for thing in things.values())
    assert not any(str(first) in bpy.path.abspath(image.filepath) for image in bpy.data.images)


@pytest.mark.slow
def test_the_artists_edits_stay(first, second, artist, tmp_path):
    """Transform, corrected material, lamp, world, exposure, name, light, parent, modifier, collection: all stay."""
    scene = bring(first).scene
    sofa, ball, lamp = named(scene, "sofa "), named(scene, "ball "), named(scene, "ceiling lamp ")
    moved = Matrix.Translation((0.5, 0.25, 0)) @ Matrix.Rotation(0.3, 4, "Z")
    sofa.matrix_basis = moved @ sofa.matrix_basis
    before = shape_in_world(sofa)
    ball.name = "crystal ball"
    ball.modifiers.new("Smoother", "SUBSURF")
    principled(ball).inputs["Roughness"].default_value = 0.77
    lamps.set_factor(lamp.data.materials[0], 2.5)
    lamps.set_on(lamp.data.materials[0], False)
    outside.set_factor(scene.world, 0.5)
    outside.set_rotation(scene.world, 0.7)
    scene.view_settings.exposure += 1
    exposure = scene.view_settings.exposure
    add_light(scene, "SOFTBOX")
    mine = bpy.data.collections.new("Mine")
    scene.collection.children.link(mine)
    mine.objects.link(sofa)
    for part in list(sofa.users_collection):
        if part != mine:
            part.objects.unlink(sofa)
    file = tmp_path / "mine.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    bpy.ops.wm.open_mainfile(filepath=str(file))

    brought = bring(second)
    scene = brought.scene
    sofa, ball, lamp = named(scene, "sofa "), named(scene, "crystal ball"), named(scene, "ceiling lamp ")
    now = shape_in_world(sofa)
    low, high = before.min(0), before.max(0)
    # Another mesh of the same sofa stands where the artist put it: the boxes agree within what noise is taken out.
    np.testing.assert_allclose((now.min(0), now.max(0)), (low, high), atol=0.06)
    assert [part.name for part in sofa.users_collection] == ["Mine"]
    assert "Smoother" in ball.modifiers and principled(ball).inputs["Roughness"].default_value == pytest.approx(0.77)
    material = lamp.data.materials[0]
    assert not lamps.is_on(material) and lamps.factor(material) == 2.5
    assert outside.factor(scene.world) == 0.5
    assert outside.rotation(scene.world) == pytest.approx(0.7)
    assert scene.view_settings.exposure == exposure
    assert [thing["scan_relight_light"] for thing in scene.objects if thing.type == "LIGHT"] == ["SOFTBOX"]
    told = " ".join(brought.warnings)
    assert "'crystal ball': the material was corrected and stays" in told and "exposure stays" in told


def test_an_edited_mesh_stays_and_wears_the_new_atlas(first, second, artist):
    """Its faces show the same part of the picture as the unedited mesh's do at the same place."""
    scene = bring(first).scene
    ball = named(scene, "ball ")
    data = ball.data
    for vertex in data.vertices:
        vertex.co *= 1.25
    before = [tuple(vertex.co) for vertex in data.vertices]
    brought = bring(second)
    assert ball.data == data and [tuple(vertex.co) for vertex in data.vertices] == before
    assert "'ball 7': the mesh was edited and is left as it is" in " ".join(brought.warnings)
    image = next(node.image for node in data.materials[0].node_tree.nodes if node.type == "TEX_IMAGE")
    assert bpy.path.abspath(image.filepath) == str(second / "base_color.exr")
    with bpy.data.libraries.load(str(second / "scene.blend"), link=False) as (there, wanted):
        wanted.objects = [name for name in there.objects if name.startswith("ball ")]
    [fresh] = wanted.objects

    def islands(mesh):
        uv = np.array([corner.vector for corner in mesh.uv_layers["ScanRelight"].uv])
        return np.concatenate([uv.min(0), uv.max(0)])

    np.testing.assert_allclose(islands(data), islands(fresh.data), atol=0.02)


def test_what_was_deleted_stays_deleted(first, second, artist):
    scene = bring(first).scene
    bpy.data.objects.remove(named(scene, "sofa "))
    brought = bring(second)
    assert not [thing for thing in scene.objects if thing.name.startswith("sofa ")]
    assert "was deleted and stays so" in " ".join(brought.warnings)


def test_a_duplicate_is_updated_too(first, second, artist):
    scene = bring(first).scene
    ball = named(scene, "ball ")
    twin = ball.copy()
    twin.data = ball.data.copy()
    twin.location.x += 1
    scene.collection.objects.link(twin)
    gap = Vector(twin.location) - ball.location
    bring(second)
    assert (Vector(twin.location) - ball.location - gap).length < 1e-5 and twin.data != ball.data
    assert twin["scan_relight_result"] == str(second)


def test_import_then_run_gives_one_room(first, artist, tiny_capture):
    before = state_of(artist)
    imported = whole(importing(read_capture(tiny_capture)))
    assert imported.scene != artist and not any(
        thing.data.materials for thing in imported.scene.objects if thing.type == "MESH"
    )
    brought = bring(first)
    assert brought.scene == imported.scene and brought.collection == imported.collection
    things = [thing for thing in bpy.data.objects if "object_id" in thing]
    assert len(things) == len({thing["object_id"] for thing in things}) == 15
    assert all(thing.data.materials[0]["scan_relight_model"] for thing in things)
    assert brought.scene.render.engine == "CYCLES" and brought.scene.view_settings.exposure != 0
    assert len(frame_cameras(brought.scene)) == len({thing.name for thing in frame_cameras(brought.scene)})
    again = whole(importing(read_capture(tiny_capture)))
    assert again.collection == brought.collection and "already" in again.warnings[0]
    assert state_of(artist) == before


@pytest.mark.parametrize("after", [1, 2, 4])
@pytest.mark.parametrize("known", [False, True])
def test_a_stopped_bringing_leaves_everything(first, second, artist, after, known):
    if known:
        bring(first)
    before = counts()
    state = {thing.name: (thing.data, thing.matrix_basis.copy()) for thing in bpy.data.objects}
    slices = bringing(second)
    for _ in range(after):
        next(slices)
    slices.close()
    assert counts() == before
    assert state == {thing.name: (thing.data, thing.matrix_basis.copy()) for thing in bpy.data.objects}


def test_what_is_wrong_is_told_and_leaves_everything(first, artist, tmp_path):
    before = counts()
    with pytest.raises(MissingStageError, match="holds no finished result"):
        bring(tmp_path)
    with pytest.raises(MissingStageError, match="import it first"):
        bring(first, known=True)
    with pytest.raises(BadInputError, match="never saved"):
        bring(first, where="FOLDER")
    broken = shutil.copytree(first, tmp_path / "broken")
    (broken / "scene.blend").write_bytes(b"no blend")
    with pytest.raises(BadInputError, match="scene.blend' can't be read"):
        bring(broken)
    assert counts() == before


def test_what_differs_is_told(first, artist, tmp_path):
    """The list holds the objects whose model or numbers moved by more than can be overlooked, and no other."""
    other = shutil.copytree(first, tmp_path / "other")
    told = json.loads((other / "materials.json").read_text())
    wall, ball = (next(one for one in told["objects"] if one["class_name"] == name) for name in ("wall", "ball"))
    wall["evidence"]["albedo"] = [value + 0.2 for value in wall["evidence"]["albedo"]]
    ball["model"] = "metal" if ball["model"] != "metal" else "specular"
    (other / "materials.json").write_text(json.dumps(told))
    bring(first)
    shown = changes.stored_changes(bring(other).scene)
    assert [one["object_id"] for one in shown] == [ball["object_id"], wall["object_id"]]
    assert "albedo" in shown[1]["text"] and "now" in shown[0]["text"]


def test_one_camera_goes_along_the_track(first, artist, tiny_capture):
    """Frame k of the timeline stands where the capture's k-th camera stood."""
    capture = read_capture(tiny_capture)
    scene = bring(first).scene
    assert (scene.frame_start, scene.frame_end) == (1, len(capture.frames))
    track = scene.objects["Scan Relight track"]
    assert track not in frame_cameras(scene)
    for k in (1, len(capture.frames) // 2, len(capture.frames)):
        scene.frame_set(k)
        wanted = capture.frames[k - 1].camera.camera_to_world
        np.testing.assert_allclose(np.array(track.matrix_world), wanted, atol=1e-4)


def test_the_camera_along_the_track_is_looked_through_by_a_button(ops, first, artist, tiny_capture):
    """Hidden till then, like those of the frames; its render goes where the capture's went."""
    scene = bring(first).scene
    bpy.context.window.scene = scene
    track = scene.objects["Scan Relight track"]
    assert not track.visible_get()
    assert ops.follow_track() == {"FINISHED"}
    assert scene.camera == track and track.visible_get()
    assert sum(thing.type == "CAMERA" and thing.visible_get() for thing in scene.objects) == 1
    scene.frame_set(3)
    wanted = read_capture(tiny_capture).frames[2].camera.camera_to_world
    np.testing.assert_allclose(np.array(track.matrix_world), wanted, atol=1e-4)
    assert ops.match_frame(index=1) == {"FINISHED"} and not track.visible_get()


def test_frames_cameras_are_hidden_but_for_the_one_looked_through(first, artist):
    """In the viewport; all of them know where they stand."""
    scene = bring(first).scene
    bpy.context.window.scene = scene

    def seen():
        return [thing for thing in frame_cameras(scene) if thing.visible_get()]

    assert seen() == [scene.camera]
    size = scene.render.resolution_x, scene.render.resolution_y
    scene.render.resolution_x = size[0] + 40
    assert "another shape" in match_frame(scene, 2, background=False)
    assert seen() == [scene.camera] == [frame_cameras(scene)[2]] and scene.render.resolution_x == size[0] + 40
    assert match_frame(scene, 2, background=False, size=True) == ""
    assert (scene.render.resolution_x, scene.render.resolution_y) == size
    assert all(thing.matrix_world.translation.length > 0 for thing in frame_cameras(scene))
