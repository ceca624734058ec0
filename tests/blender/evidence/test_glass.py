"""A slab of real glass in a room that Cycles rendered is set apart, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.bridge.data.unwrap import unwrap  # noqa: E402
from addon.bridge.demo import render  # noqa: E402
from addon.bridge.demo.room import Paint, RoomObject, grid, room, tour  # noqa: E402
from addon.core.brdf.transparent import TRANSPARENT  # noqa: E402
from addon.core.io.read import read_capture  # noqa: E402
from addon.core.passes.albedo.albedo import NONE  # noqa: E402
from addon.core.pipeline.recover import Recovery  # noqa: E402
from addon.core.progress import Progress  # noqa: E402
from addon.core.results.store import Store  # noqa: E402
from addon.core.settings import Settings  # noqa: E402
from tests.blender.evidence.known_rooms import KnownRoom  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.arithmetic]

PANE = "pane"


def slab(object_id: int, corner, across, up, thickness: float) -> RoomObject:
    """The two large sides of a standing slab."""
    corner, across, up = (np.array(x, float) for x in (corner, across, up))
    off = np.cross(up, across)
    off *= thickness / np.linalg.norm(off)
    sides = [grid(corner, across, up, 4, 4), grid(corner + off + across, -across, up, 4, 4)]
    quads, uv = (np.concatenate(parts) for parts in zip(*sides))
    return RoomObject(object_id, PANE, quads, uv, np.zeros(len(quads), int), (Paint(np.ones(3, np.float32)),))


def material(name: str, paint: Paint):
    """The demo's material, but glass for the pane."""
    made = _plain(name, paint)
    if name == PANE:
        shader = next(n for n in made.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        shader.inputs["Base Color"].default_value = (1, 1, 1, 1)
        shader.inputs["Transmission Weight"].default_value = 1
        shader.inputs["Roughness"].default_value = 0
        shader.inputs["IOR"].default_value = 1.45
        shader.inputs["Specular IOR Level"].default_value = 0.5
    return made


_plain = render.material


@pytest.mark.slow
def test_glass_is_set_apart(tmp_path, monkeypatch):
    monkeypatch.setattr(render, "material", material)
    things = room()
    pane = slab(max(one.object_id for one in things) + 1, (1.6, 1.5, 0.7), (1.2, 0, 0), (0, 0, 1.1), 0.01)
    known = KnownRoom((*things, pane), tour(20))
    capture = read_capture(known.render(tmp_path / "capture", (96, 72), 24))
    with Store(tmp_path / "result") as store:
        run = Recovery(capture, store, Settings(specular_rays=64, texel_size=0.04), Progress(), unwrap)
        found = {m.class_name: m for m in run.materials() if m.model == TRANSPARENT}
        assert set(found) == {PANE}, {m.class_name: (m.model, m.scores) for m in run.materials()}
        # Fresnel's reflection takes 0.07 to 0.15 of what comes through at these angles.
        assert found[PANE].surfaces == pytest.approx(2, abs=0.1) and 0.75 < found[PANE].transmission < 0.97
        own = run.surface().atlas.object_id == pane.object_id
        assert (run.albedo.origin[own] == NONE).all() and not (run.albedo.origin[~own] == NONE).all()
