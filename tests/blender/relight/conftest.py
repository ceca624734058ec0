"""The demo's small room, recovered once in its own process, as a result folder; a fresh scene for each test."""

import subprocess
import sys

import numpy as np
import pytest

from tests.blender.conftest import honest

QUICK = (
    "--shading-rays 16 --specular-rays 4 --emitter-rays 2 --refine 0 --texel-size 0.1 --atlas-size 512 --quiet".split()
)


@pytest.fixture(scope="session")
def result(tmp_path_factory, tiny_capture, root):
    """A result folder of the demo's room, recovered with very few rays."""
    folder = tmp_path_factory.mktemp("relight") / "result"
    code = "import sys; from addon.cli import main; sys.exit(main(sys.argv[1:]))"
    done = subprocess.run(
        [sys.executable, "-c", code, "recover", str(tiny_capture), "--out", str(folder), *QUICK],
        cwd=root,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def room(result):
    """The recovered room, opened."""
    bpy = pytest.importorskip("bpy")
    bpy.ops.wm.open_mainfile(filepath=str(result / "scene.blend"), load_ui=False)
    scene = bpy.context.scene
    honest(scene)
    return scene


@pytest.fixture
def shoot(tmp_path):
    """``shoot(scene, width, height, samples)``: (height, width, 3) float32, row 0 at the top, linear Rec.709."""
    from addon.bridge.relight import pictures
    from addon.core.io.exr import read_exr

    def render(scene, width, height, samples):
        scene.render.resolution_x, scene.render.resolution_y = width, height
        scene.render.resolution_percentage = 100
        scene.cycles.samples = samples
        pictures.render_to_file(scene, tmp_path / "shot.exr")
        return np.array(read_exr(tmp_path / "shot.exr").rgb)

    return render


@pytest.fixture
def look_down(scene):
    """An orthographic camera that sees `width` m of the floor around the origin from 1 m above."""
    import bpy

    def put(width=0.2, height=1.0):
        data = bpy.data.cameras.new("look")
        data.type, data.ortho_scale, data.clip_start = "ORTHO", width, 1e-3
        scene.camera = bpy.data.objects.new("look", data)
        scene.camera.location.z = height
        scene.collection.objects.link(scene.camera)

    return put
