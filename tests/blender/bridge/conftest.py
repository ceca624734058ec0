"""A fresh factory scene for each test, and tiny Cycles renders of it as arrays."""

import numpy as np
import pytest


@pytest.fixture
def shoot(scene, tmp_path):
    """Render `scene` through its camera: ``shoot(width, height, samples)`` gives (height, width, 4) float32, row 0 at
    the top, linear Rec.709, background transparent if the scene says so."""
    import bpy

    def render(width, height, samples):
        settings = scene.render
        settings.resolution_x, settings.resolution_y, settings.resolution_percentage = width, height, 100
        settings.image_settings.file_format, settings.image_settings.color_mode = "OPEN_EXR", "RGBA"
        settings.image_settings.color_depth = "32"
        scene.cycles.samples = samples
        settings.filepath = str(tmp_path / "render.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(settings.filepath)
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return pixels.reshape(height, width, 4)[::-1]

    return render


@pytest.fixture
def look(scene):
    """Put an orthographic camera at `place` ((3,) metres), turned by `rotation` (Euler, radians), `width` m wide."""
    import bpy

    def put(place, rotation=(0, 0, 0), width=2.1):
        data = bpy.data.cameras.new("look")
        data.type, data.ortho_scale = "ORTHO", width
        scene.camera = bpy.data.objects.new("look", data)
        scene.camera.location, scene.camera.rotation_euler = place, rotation
        scene.collection.objects.link(scene.camera)

    return put


@pytest.fixture
def white_world(scene):
    """Light of radiance 1 from everywhere."""
    import bpy

    world = bpy.data.worlds.new("white")
    if world.node_tree is None:
        world.use_nodes = True
    next(n for n in world.node_tree.nodes if n.type == "BACKGROUND").inputs["Color"].default_value = (1, 1, 1, 1)
    scene.world = world
