"""What the sockets say, as other programs (and the scorer) read them."""

import math

import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.emitter import EMITTER, LAMP_ALBEDO
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import ObjectMaterial
from addon.core.brdf.metal import METAL
from addon.core.brdf.transparent import TRANSPARENT

bpy = pytest.importorskip("bpy")

from addon.bridge.data.materials import dress, f0_of, make_material  # noqa: E402
from addon.core.brdf.compensation import ior_of  # noqa: E402


def sockets(material):
    node = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    return node.inputs, lambda name: node.inputs[name].default_value


def f0(value):
    return ((value("IOR") - 1) / (value("IOR") + 1)) ** 2 * 2 * value("Specular IOR Level")


def test_lambertian(scene):
    image = bpy.data.images.new("base", 4, 4)
    inputs, value = sockets(make_material(ObjectMaterial(3, "Wall", LAMBERTIAN), image))
    assert f0(value) == 0 and value("Roughness") == 0.5 and value("Metallic") == 0 and value("Emission Strength") == 0
    texture = inputs["Base Color"].links[0].from_node
    assert texture.image == image and texture.inputs[0].links[0].from_node.uv_map == "ScanRelight"


@pytest.mark.parametrize("psi", [0.02, 0.04, 0.3, 0.89])
def test_specular(scene, psi):
    material = make_material(ObjectMaterial(3, "Table", DIELECTRIC, alpha=0.16, f0=psi))
    _, value = sockets(material)
    assert value("Roughness") == pytest.approx(0.4) and f0(value) == pytest.approx(psi, rel=1e-5)
    assert material["scan_relight_model"] == DIELECTRIC.name
    assert (material["scan_relight_alpha"], material["scan_relight_f0"]) == (0.16, psi)


def test_a_material_of_version_0_1_is_read_and_renewed(scene):
    material = bpy.data.materials.new("Table")
    material["scan_relight_phi"], material["scan_relight_psi"] = 0.16, 0.05
    assert f0_of(material) == 0.05
    dress(material, ObjectMaterial(3, "Table", LAMBERTIAN))
    assert "scan_relight_phi" not in material and f0_of(material) is None


@pytest.mark.parametrize(("surfaces", "alpha"), [(1, 0.36), (2, 0.2), (None, 1)], ids=["sheet", "slab", "cut out"])
def test_transparent(scene, surfaces, alpha):
    """Both surfaces of a slab together pass what was seen to pass; what is cut out stays opaque."""
    image = bpy.data.images.new("base", 4, 4)
    material = make_material(ObjectMaterial(3, "Pane", TRANSPARENT, transmission=0.64, surfaces=surfaces), image)
    inputs, value = sockets(material)
    assert value("Alpha") == pytest.approx(alpha) and f0(value) == 0 and inputs["Base Color"].links
    assert material["scan_relight_transmission"] == 0.64


@pytest.mark.parametrize("psi", [-0.1, 0.0, 0.99, 1.0, 7.0])
def test_ior_stays_finite(psi):
    assert 1 <= ior_of(psi) < 40 and math.isfinite(ior_of(psi))


def test_metal(scene):
    inputs, value = sockets(make_material(ObjectMaterial(3, "Tap", METAL, alpha=0.04, f0=(0.9, 0.6, 1.2))))
    assert value("Metallic") == 1 and value("Roughness") == pytest.approx(0.2)
    assert tuple(value("Base Color")) == pytest.approx((0.9, 0.6, 1.0, 1)) and not inputs["Base Color"].links


@pytest.mark.parametrize("radiance", [(30.0, 15.0, 3.0), (0.0, 0.0, 0.0), (0.1, 0.2, 0.05)])
def test_emitter(scene, radiance):
    _, value = sockets(make_material(ObjectMaterial(3, "Lamp", EMITTER, emission=radiance)))
    assert tuple(c * value("Emission Strength") for c in value("Emission Color"))[:3] == pytest.approx(radiance)
    assert max(value("Emission Color")[:3]) == 1 and f0(value) == 0
    assert tuple(value("Base Color")) == (*[LAMP_ALBEDO] * 3, 1)
