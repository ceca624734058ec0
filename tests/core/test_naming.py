"""Objects have one name, and it stays whole where it matters."""

import pytest

from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import ObjectMaterial
from addon.core.naming import in_order, numbered
from addon.core.scene.model import Instance


@pytest.mark.parametrize(
    ("kind", "number", "name"),
    [
        ("sofa", 12, "sofa 12"),
        ("", 3, "Object 3"),
        (" \n", 3, "Object 3"),
        ("coffee\ttable ", 0, "coffee table 0"),
        ("half \ud83d", 4, "half \ufffd 4"),
    ],
)
def test_an_object_and_its_material_have_one_name(kind, number, name):
    assert Instance(number, kind).name == ObjectMaterial(number, kind, LAMBERTIAN).name == name


@pytest.mark.parametrize("kind", ["a very long class name " * 9, "\u00dcberwurf\u00fc" * 20, "\u6c99\u767a" * 40])
def test_a_long_class_is_cut_between_letters_and_the_number_never(kind):
    names = {Instance(number, kind).name for number in (1, 10, 1234567)}
    assert len(names) == 3 and all(numbered(name)[1] in ("1", "10", "1234567") for name in names)
    for name in names:
        assert len(f"{name} base color.001".encode()) <= 63
        assert kind.startswith(numbered(name)[0])


def test_lamps_are_sorted_by_their_numbers():
    names = ["lamp 10", "lamp 2", "Lamp 1", "bulb 3", "sky"]
    assert sorted(names, key=in_order) == ["bulb 3", "Lamp 1", "lamp 2", "lamp 10", "sky"]
    assert numbered("lamp 2.001") == ("lamp", "2.001") and numbered("reading lamp") == ("reading lamp", "")
