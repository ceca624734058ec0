"""Recovered materials as assets: what is marked, what is said of it, and the way back."""

from __future__ import annotations

import json

import pytest

bpy = pytest.importorskip("bpy")

from addon.bridge.custom_properties import set_run as from_run  # noqa: E402
from addon.bridge.data.materials import make_material  # noqa: E402
from addon.bridge.export import assets  # noqa: E402
from addon.core.brdf.material import ObjectMaterial  # noqa: E402
from addon.core.brdf.registry import named  # noqa: E402


@pytest.fixture
def things(scene, tmp_path):
    """Two objects with recovered materials of the scan 'den', and one with a material of the artist's."""
    (tmp_path / "materials.json").write_text(json.dumps({"objects": [], "capture": "den"}))
    made = []
    for number, model in enumerate(("lambertian", "specular", None)):
        thing = bpy.data.objects.new(f"thing {number}", bpy.data.meshes.new("thing"))
        scene.collection.objects.link(thing)
        if model is None:
            thing.data.materials.append(bpy.data.materials.new("my own"))
        else:
            more = {"alpha": 0.1, "f0": 0.04} if model == "specular" else {}
            thing.data.materials.append(make_material(ObjectMaterial(number, "thing", named(model), **more)))
            from_run(thing, tmp_path, "")
        made.append(thing)
    return made


def test_recovered_materials_are_marked_and_others_are_not(things):
    assert assets.mark(things) == 2
    diffuse, glossy, own = (thing.material_slots[0].material for thing in things)
    assert own.asset_data is None and diffuse.asset_data is not None
    assert {tag.name for tag in glossy.asset_data.tags} == {"Scan Relight", "den", "specular"}
    assert "scan 'den'" in glossy.asset_data.description and glossy.asset_data.author


def test_marking_twice_changes_nothing_and_clearing_takes_all_back(things):
    assets.mark(things)
    assert assets.mark(things) == 2
    assert len(things[0].material_slots[0].material.asset_data.tags) == 3
    assert assets.clear(things) == 2 and assets.clear(things) == 0
    assert all(thing.material_slots[0].material.asset_data is None for thing in things)
