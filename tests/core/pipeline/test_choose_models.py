"""What an object's own frames say of its model, and what others of its class do."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.passes.specular.models import choose_model
from addon.core.pipeline.choose_models import Looked, Room, _by_frames, choose_models
from addon.core.scene.model import Instance
from addon.core.settings import Settings
from tests.core.fit.test_fit import paint
from tests.core.glossy_box import Box


@pytest.mark.parametrize(
    ("guess", "name", "second", "without", "shared"),
    [
        (False, "wall", 0.2, "", True),
        (False, "wall", 0.6, "", True),
        (True, "wall", 0.2, "", False),
        (True, "wall", 0.6, "", True),
        (True, "wall", 0.6, "class-lobes", False),
        (True, "part", 0.6, "", False),
    ],
)
def test_a_class_that_shape_alone_tells_shares_no_lobe_but_walls_of_one_colour_do(guess, name, second, without, shared):
    """A glossy wall of albedo .6, and one whose few frames tell no lobe, whose albedo is .6 or another."""
    box = Box()
    element, direction, _ = box.views(60, 10)
    glossy = box.problem(element, direction, 0.11, 0.08, paint(element))
    few = np.isin(element, np.unique(element)[:5])
    looked = {i: Looked(choose_model(one), one, -1) for i, one in enumerate((glossy, glossy.part(few)))}
    instances = tuple(Instance(i, name, guess=guess) for i in looked)
    owner = np.repeat([0, 1], 20)
    atlas = SimpleNamespace(object_id=owner, elements_of=lambda i: np.flatnonzero(owner == i))
    seen, irradiance = np.arange(40) % 4 > 0, np.full((40, 3), 2 * np.pi)
    radiance = np.where(seen, 2 * np.where(owner == 0, 0.6, second), np.nan)[:, None] * np.ones(3)
    lit_diffuse = SimpleNamespace(seen=seen, radiance=radiance)
    settings = Settings(without=(without,) if without else ())
    room = Room(instances, SimpleNamespace(atlas=atlas), lit_diffuse, irradiance, None, [], settings=settings)
    models = [chosen.choice.model for _, chosen in sorted(choose_models(room, looked).items())]
    assert models == [DIELECTRIC, DIELECTRIC if shared else LAMBERTIAN]


@pytest.mark.parametrize(
    ("guess", "anywhere", "expected", "without", "shown"),
    [
        (False, "glossy", "bare", "", "glossy"),
        (False, "bare", "glossy", "", "glossy"),
        (True, "glossy", "bare", "", "bare"),
        (True, "bare", "glossy", "", "glossy"),
        (True, "glossy", "broad", "", "glossy"),
        (True, "glossy", "bare", "highlight-sampling", "glossy"),
    ],
)
def test_where_highlights_are_expected_decides_of_a_part(guess, anywhere, expected, without, shown):
    """What samples of all the object show, and those where highlights are expected; of an object either will do."""
    box = Box()
    element, direction, _ = box.views(60, 10)
    problems = {
        name: box.problem(element, direction, phi, psi, paint(element))
        for name, phi, psi in (("bare", None, 0), ("glossy", 0.11, 0.08), ("broad", 0.3, 0.08))
    }
    names = list(problems)
    maker = SimpleNamespace(
        pick=lambda *_, highlights, **__: np.array([names.index(expected if highlights else anywhere)]),
        problem=lambda index, rays: problems[names[index[0]]],
    )
    room = SimpleNamespace(settings=Settings(without=(without,)), problems=maker)
    choice, problem, index = _by_frames(room, 0, guess)
    assert problem is problems[shown] and names[index[0]] == shown
    assert choice.model == (LAMBERTIAN if shown == "bare" else DIELECTRIC)
