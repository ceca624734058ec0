"""The rooms that failures are looked for in: a tiny one is rendered whole, and its truth agrees with itself."""

from __future__ import annotations

import json

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.core.io.exr import read_exr  # noqa: E402
from addon.core.io.read import read_capture  # noqa: E402
from scripts.qa_rooms.render import TOO_NEW, render  # noqa: E402
from scripts.qa_rooms.rooms import ROOMS  # noqa: E402


@pytest.fixture(scope="module")
def office(tmp_path_factory):
    if bpy.app.version >= TOO_NEW:
        pytest.skip("rooms are made with Blender 4.5: newer modules write no passes")
    folder = tmp_path_factory.mktemp("rooms") / "office"
    render(ROOMS["office"](1), folder, 3, (40, 30), 8, 2, False)
    return folder


def truth(folder, kind: str) -> np.ndarray:
    return np.stack([read_exr(path).rgb for path in sorted((folder / "truth" / kind).glob("*.exr"))])


@pytest.mark.slow
def test_it_is_a_capture(office):
    capture = read_capture(office)
    assert len(capture.frames) == 3
    assert {i.object_id for i in capture.instances} == set(np.unique(capture.mesh.object_id))
    assert all(read_exr(path).rgb.max() > 0 for path in (office / "images").iterdir())


def test_the_truth_agrees_with_itself(office):
    objects = {o["id"]: o for o in json.loads((office / "truth" / "materials.json").read_text())}
    ids, albedo, colour = truth(office, "object_id")[..., 0], truth(office, "albedo"), truth(office, "diffuse_color")
    light, image = truth(office, "diffuse_light"), truth(office, "image")
    diffuse = np.isin(ids, [i for i, o in objects.items() if o["bsdf"] == "diffuse" and not o["emission"]])
    middle = ids[:, 1:-1, 1:-1]
    inside = diffuse[:, 1:-1, 1:-1] & (middle == ids[:, 1:-1, :-2]) & (middle == ids[:, :-2, 1:-1])
    inside &= (middle == ids[:, 1:-1, 2:]) & (middle == ids[:, 2:, 1:-1])
    assert inside.sum() > 300
    pictures = {"albedo": albedo, "colour": colour, "light": light, "image": image}
    picked = {name: x[:, 1:-1, 1:-1][inside] for name, x in pictures.items()}
    assert np.median(np.abs(picked["albedo"] / picked["colour"] - 1)) < 0.02
    made = picked["light"] * picked["colour"]  # pixels with an edge of a texture in them differ
    assert np.median(np.abs(made - picked["image"]) / (picked["image"] + 1e-4)) < 0.01


def test_every_kind_has_metals_gloss_and_light():
    for make in ROOMS.values():
        room = make(3)
        paints = [thing.paints[0] for thing in room.objects]
        assert any(p.metallic for p in paints) and sum(bool(p.f0) and not p.metallic for p in paints) > 5
        assert any(p.emission for p in paints) or any(room.sky)
        assert [thing.object_id for thing in room.objects] == list(range(len(room.objects)))


def test_seeds_change_a_room():
    one, other = ROOMS["kitchen"](1), ROOMS["kitchen"](2)
    assert not np.allclose(one.objects[2].paints[0].albedo, other.objects[2].paints[0].albedo)


def test_a_ground_goes_on_around_the_room():
    room, plain = ROOMS["office"](1), ROOMS["office"](1)
    room.surround(100)
    assert [thing.class_name for thing in room.objects] == [*(thing.class_name for thing in plain.objects), "ground"]
    corners = room.objects[-1].quads.reshape(-1, 3)
    assert np.ptp(corners, axis=0)[:2] == pytest.approx([100 * max(room.size[:2])] * 2)
    assert corners[:, 2].max() < min(thing.quads[..., 2].min() for thing in plain.objects)
