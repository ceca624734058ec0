"""A pane, a card with holes and an opaque card before walls of many colours: pictures by arithmetic."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.brdf.transparent import TRANSPARENT, opacity
from addon.core.passes.see_through.see_through import look_behind
from addon.core.pipeline import choose_models
from addon.core.pipeline.choose_models import Room as Views
from addon.core.pipeline.specular import fit_specular
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.scene.samples import Samples
from addon.core.scene.visibility import CLEAN
from addon.core.settings import Settings
from tests.core.rooms import box_sides, make_room, quad

SIZE = np.array([4.0, 3.0, 2.5])
PANE, GREY = 6, 0.3
EYES = np.random.default_rng(3).uniform((0.3, 0.3, 0.5), (1.4, 2.7, 2.0), (14, 3))


def tone(points: np.ndarray) -> np.ndarray:
    """Radiance of the walls, (..., 3)."""
    waves = [np.sin(points @ np.array(k) + i) for i, k in enumerate(((3, 4, 2), (-2, 3, 4), (4, -2, 3)))]
    return 0.5 + 0.35 * np.stack(waves, -1)


def walls(origin: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Radiance along rays that nothing but the walls stops."""
    with np.errstate(divide="ignore"):
        far = np.where(way > 0, (SIZE - origin) / way, -origin / way)
    return tone(origin + np.where(way == 0, np.inf, far).min(-1, keepdims=True) * way)


class Room:
    """A card across the room, seen from one side: a sheet, or the front and the back of a slab."""

    def __init__(self, thickness: float = 0.0):
        card = [quad((2, 0.8, 0.6), (0, 0, 1.2), (0, 1.4, 0), PANE)]
        if thickness:
            card.append(quad((2 + thickness, 0.8, 0.6), (0, 1.4, 0), (0, 0, 1.2), PANE))
        self.room = make_room(box_sides(tuple(SIZE)) + card, 0.06)
        atlas = self.room.atlas
        self.radiance = tone(atlas.position.astype(float)).astype(np.float32)
        self.radiance[atlas.object_id == PANE] = GREY
        front = np.flatnonzero((atlas.object_id == PANE) & (atlas.normal[:, 0] < -0.5))
        self.element = np.repeat(front, len(EYES))
        self.frame = np.tile(np.arange(len(EYES)), len(front))
        self.place = atlas.position[self.element].astype(float)
        way = EYES[self.frame] - self.place
        self.direction = way / np.linalg.norm(way, axis=1, keepdims=True)
        self.behind = walls(self.place, -self.direction)

    def recovered(self, radiance: np.ndarray, mesh_noise: float = 0.0):
        """The card's material and what was taken out of its L_d, from observations of it."""
        noise = np.exp(0.02 * np.random.default_rng(1).normal(size=radiance.shape))
        samples = Samples(self.element.astype(np.int32), self.frame.astype(np.int32),
                          (radiance * noise).astype(np.float32), self.direction.astype(np.float32),
                          np.zeros(len(radiance), bool), np.zeros(len(radiance), np.float32))  # fmt: skip
        own = np.unique(self.element)
        lit, n = self.radiance.copy(), len(self.room.atlas)
        lit[own] = np.median(samples.radiance.reshape(len(own), len(EYES), 3), 1)
        count = np.full(n, 14, np.int32)
        count[np.setdiff1d(np.flatnonzero(self.room.atlas.object_id == PANE), own)] = 0
        seen = LitDiffuse(lit, np.zeros_like(lit), count, np.full(n, CLEAN, np.int8), np.zeros(n, np.float32))
        card = tuple(i for i in self.room.instances if i.object_id == PANE)
        names, settings = [f"{k}" for k in range(len(EYES))], Settings(specular_rays=64, threads=2)
        found = fit_specular(Views(card, self.room.field(lit), seen, np.ones((n, 3), np.float32), samples, names,
                                   noise=mesh_noise, settings=settings))  # fmt: skip
        return found.materials[0], found.specular[own], lit[own]


@pytest.mark.parametrize("thickness", [0.0, 0.01], ids=["sheet", "slab"])
@pytest.mark.parametrize("tau", [0.3, 0.8])
def test_glass(thickness, tau):
    room = Room(thickness)
    material, passed, lit = room.recovered(0.1 + tau * room.behind)
    assert material.model == TRANSPARENT and material.scores[TRANSPARENT.name] < 0.2
    assert material.transmission == pytest.approx(tau, abs=0.05)
    assert material.surfaces == pytest.approx(2 if thickness else 1, abs=0.1)
    assert opacity(material) == pytest.approx(1 - tau ** (0.5 if thickness else 1), abs=0.05)
    assert np.median(lit - passed) == pytest.approx(0.1, abs=0.03)  # its own light


def test_a_card_with_holes():
    room = Room()
    cell = np.floor(room.place / 0.15).astype(int)[:, 1:].sum(1)
    material, passed, _ = room.recovered(np.where((cell % 3 == 0)[:, None], room.behind, 0.15))
    assert material.model == TRANSPARENT and "cut out" in material.note
    assert material.transmission == pytest.approx(1 / 3, abs=0.08)
    assert material.surfaces is None and opacity(material) == 1 and not passed.any()


@pytest.mark.parametrize("texture", [0.0, 0.5], ids=["plain", "textured"])
def test_an_opaque_card(texture):
    room = Room()
    own = GREY * np.exp(texture * np.sin(40 * room.place))
    material, passed, _ = room.recovered(own)
    assert material.model != TRANSPARENT and opacity(material) == 1 and not passed.any()


def test_a_card_that_the_scan_made_too_large():
    """Along 15 cm of its rim the frames show the room behind; a noise of 5 cm may have put that rim there."""
    room = Room()
    y, z = room.place[:, 1] - 0.8, room.place[:, 2] - 0.6
    inner = (np.minimum(y, 1.4 - y) > 0.15) & (np.minimum(z, 1.2 - z) > 0.15)
    shown = np.where(inner[:, None], GREY, room.behind)
    assert room.recovered(shown)[0].model == TRANSPARENT
    material, passed, _ = room.recovered(shown, 0.05)
    assert material.model != TRANSPARENT and not passed.any()


def test_glass_in_a_noisy_scan():
    room = Room()
    material, _, _ = room.recovered(0.1 + 0.5 * room.behind, 0.05)
    assert material.model == TRANSPARENT and material.transmission == pytest.approx(0.5, abs=0.05)


def test_a_sheet_on_a_wall_of_its_own_colour():
    """What lies behind looks the same: nothing says that it is seen through."""
    room = Room()
    material, _, _ = room.recovered(np.broadcast_to(room.behind.mean(0), room.behind.shape))
    assert material.model != TRANSPARENT


def test_what_lies_behind():
    room = Room(0.01)
    seen = np.ones(len(room.room.atlas), bool)
    found = look_behind(room.room.field(room.radiance), seen, room.element, room.direction.astype(np.float32), PANE)
    assert found.known.all() and (found.surfaces == 2).mean() > 0.95
    assert np.median(np.abs(found.radiance - room.behind)) < 0.05
    hidden = look_behind(room.room.field(room.radiance), ~seen, room.element, room.direction.astype(np.float32), PANE)
    assert not hidden.known.any()


@pytest.mark.parametrize(("share", "told"), [(0.05, False), (0.5, True)])
def test_a_few_elements_at_its_rim_do_not_make_it_glass(share, told, monkeypatch):
    """The pixels of a pole three pixels wide are mixed with what is behind it; only there is that known."""

    def at_the_rim(field, seen, element, direction, object_id, noise=0.0):
        found = look_behind(field, seen, element, direction, object_id, noise)
        y = field.atlas.position[element, 1] - 0.8
        return replace(found, known=found.known & (y < share * 1.4))

    monkeypatch.setattr(choose_models, "look_behind", at_the_rim)
    room = Room()
    material, _, _ = room.recovered(0.1 + 0.5 * room.behind)
    assert (material.model == TRANSPARENT) == told
