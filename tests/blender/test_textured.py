"""A textured mesh alone: its light is taken from the texture, and the albedo is better than the texture itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from addon.bridge.data.import_mesh import import_mesh
from addon.core.errors import BadInputError
from addon.core.io.folder import CAPTURE, look_into
from addon.core.io.layout import Reading
from addon.core.io.png import write_png
from addon.core.io.read import read_capture
from addon.core.lit_diffuse.from_picture import lit_from_picture, texel_edge
from addon.core.pipeline.recover import Recovery
from addon.core.progress import Progress
from addon.core.results.store import Store
from tests.core.on_disk import ALBEDO, CHEAP, LAMP, Finished
from tests.core.rooms import lit_box, make_room, radiosity
from tests.core.textured_on_disk import glb, write_textured

READING = Reading(import_mesh=import_mesh)


@pytest.fixture(scope="module")
def lit():
    """A box with a lamp, and its radiance by element."""
    room = make_room(lit_box(lamps=(((0.3, 0.7), (0.3, 0.7)),)), 0.05)
    return room, radiosity(room, ALBEDO, {6: LAMP})


def psnr(values, truth):
    return -10 * np.log10(np.mean((values - truth) ** 2))


@pytest.mark.slow
@pytest.mark.parametrize(("exposure", "better"), [(0.09, 25), (0.45, 4)], ids=["whole", "clipped"])
def test_the_albedo_is_better_than_the_texture(lit, tmp_path, exposure, better):
    room, light = lit
    write_textured(tmp_path / "room", room, np.minimum(exposure * light, 1))
    assert look_into(tmp_path / "room").kind == CAPTURE
    capture = read_capture(tmp_path / "room", READING)
    assert capture.format == "textured" and any("weaker than frames" in one for one in capture.warnings)
    with Store(tmp_path / "result") as store:
        done = Finished(Recovery(capture, store, CHEAP, Progress(), lambda mesh, size: capture.mesh.uv))
        page = (tmp_path / "result/report.html").read_text()
    assert done.report["tier"] == "baked" and "baked texture" in page
    assert not any(one.model.has_lobe for one in done.materials)
    of = room.atlas.object_id[cKDTree(room.atlas.position).query(done.atlas.position)[1]]
    own = done.lit.seen & (of < 6)
    truth = np.array([np.broadcast_to(ALBEDO[i], 3) for i in range(6)])[of[own]]
    texture = done.lit.radiance[own]
    best = texture * ((texture * truth).sum() / (texture**2).sum())
    assert psnr(done.albedo.rho[own], truth) > psnr(best, truth) + better


def test_each_element_finds_its_texel(lit, tmp_path):
    room, light = lit
    light = np.minimum(0.3 * light, 1).astype(np.float32)
    write_textured(tmp_path, room, light)
    mesh = read_capture(tmp_path, READING).mesh
    assert texel_edge(mesh, mesh.lit) == pytest.approx(0.1, rel=0.3)  # two texels
    found = lit_from_picture(mesh, mesh.lit, room.atlas)
    inner = found.seen & (room.atlas.object_id < 6)
    assert inner.sum() > 0.9 * (room.atlas.object_id < 6).sum()
    assert np.median(np.abs(found.radiance[inner] / light[inner] - 1)) < 0.02


def test_obj_materials_lead_to_their_pictures(tmp_path):
    for name, colour in (("a b.png", (255, 0, 0)), ("c.png", (0, 0, 255))):
        write_png(tmp_path / name, np.broadcast_to(np.uint8(colour), (8, 8, 3)).copy())
    (tmp_path / "m.mtl").write_text("newmtl second\nmap_Kd -s 1 1 1 c.png\nnewmtl first\nmap_Kd a b.png\n")
    corners = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1))]
    lines = ["mtllib m.mtl", *(f"v {x} {y} {z}" for x, y, z in corners), "vt 0 0", "vt 1 0", "vt 1 1"]
    lines += ["usemtl first", "f 1/1 2/2 3/3", "usemtl second", "f 4/1 5/2 6/3"]
    (tmp_path / "scan.obj").write_text("\n".join(lines) + "\n")
    mesh = read_capture(tmp_path, READING).mesh
    height = mesh.vertices[mesh.triangles][:, 0, 2]
    names = [mesh.lit.pictures[i].path.name for i in mesh.lit.picture]
    assert dict(zip(height.tolist(), names, strict=True)) == {0.0: "a b.png", 1.0: "c.png"}


def nothing(content: bytes) -> bytes:
    return content.replace(b'"baseColorTexture"', b'"noneColorTexture"')


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (nothing, "no texture"),
        (lambda content: content.replace(b'"source": 0', b'"source": 9'), "does not hold"),
        (lambda content: content.replace(b'"source": 0', b'"sourcf": 0'), "neither PNG nor JPEG"),
        (lambda content: content.replace(b"\x89PNG", b"\x89PIG"), "texture of"),
        (lambda content: content.replace(b'"bufferView": 2', b'"uri": "/a.png"'), "does not lie beside it"),
        (lambda content: content.replace(b'"texCoord": 0', b'"texCoord": 1'), "no texture"),
    ],
)
def test_what_is_wrong_is_one_sentence(lit, tmp_path, spoil, words):
    room, light = lit
    path = write_textured(tmp_path, room, np.minimum(light, 1))
    write_png(tmp_path / "t.png", np.full((8, 8, 3), 90, np.uint8))
    content = glb(room, (tmp_path / "t.png").read_bytes(), texCoord=0)
    path.write_bytes(spoil(content))
    assert spoil(content) != content
    with pytest.raises(BadInputError) as error:
        read_capture(tmp_path, READING)
    assert words in str(error.value) and path.name in str(error.value) and "\n" not in str(error.value)


def test_a_texture_that_goes_during_the_run(lit, tmp_path):
    room, light = lit
    path = write_textured(tmp_path, room, np.minimum(light, 1))
    mesh = read_capture(tmp_path, READING).mesh
    path.unlink()
    with pytest.raises(BadInputError, match="changed during the run"):
        lit_from_picture(mesh, mesh.lit, room.atlas)
    with pytest.raises(BadInputError, match="changed during the run"):
        texel_edge(mesh, mesh.lit)


def test_segments_of_a_textured_mesh(lit, tmp_path):
    room, light = lit
    write_textured(tmp_path / "scan", room, light)
    read = read_capture(tmp_path / "scan", replace(READING, segments="materials"))
    assert [one.class_name for one in read.instances] == ["material_0"] and not read.instances[0].guess
    (tmp_path / "ids.txt").write_text("\n".join(map(str, room.mesh.object_id)))
    read = read_capture(tmp_path / "scan", replace(READING, segments=tmp_path / "ids.txt"))
    assert np.array_equal(read.mesh.object_id, room.mesh.object_id) and read.mesh.lit is not None
