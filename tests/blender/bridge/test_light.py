"""Round trips through Cycles: does light come out of our materials as the method wrote it?"""

import numpy as np
import pytest

from addon.core.brdf.compensation import base_color
from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.emitter import EMITTER, LAMP_ALBEDO
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.brdf.material import ObjectMaterial
from addon.core.brdf.metal import METAL

bpy = pytest.importorskip("bpy")

from addon.bridge.data.images import array_image  # noqa: E402
from addon.bridge.data.materials import make_material  # noqa: E402
from addon.bridge.data.mesh_objects import ATLAS_UV  # noqa: E402

LOBES = [(0.1, 0.04), (0.4, 0.04), (0.1, 0.3), (0.4, 0.3)]
"""phi, psi."""


def plain(colour):
    return array_image("plain", np.broadcast_to(np.float32(colour), (4, 4, 3)))


def add(kind, material, name=ATLAS_UV, **settings):
    {"sphere": bpy.ops.mesh.primitive_ico_sphere_add, "plane": bpy.ops.mesh.primitive_plane_add}[kind](**settings)
    thing = bpy.context.object
    thing.data.uv_layers[0].name = name
    thing.data.materials.append(material)
    return thing


def schlick(cosine, psi):
    return psi + (1 - psi) * (1 - cosine) ** 5


def dielectric(cosine, psi):
    """Fresnel's own formula for the index of refraction that `psi` means."""
    ior = (1 + np.sqrt(psi)) / (1 - np.sqrt(psi))
    g = np.sqrt(ior**2 - 1 + cosine**2)
    return (
        0.5
        * ((g - cosine) / (g + cosine)) ** 2
        * (1 + ((cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)) ** 2)
    )


def lobe(w, v, normal, phi, psi, fresnel=schlick):
    """The method's f_nd = G D F of unit vectors, (...,)."""
    half = w + v
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    nw, nv, nh = ((normal * x).sum(-1) for x in (w, v, half))
    wh = (w * half).sum(-1)
    g1 = lambda x: 1 / (x + np.sqrt(x * x + phi**2 - x * x * phi**2))  # noqa: E731
    d = phi**2 / (np.pi * (1 + (phi**2 - 1) * nh**2) ** 2)
    return np.where((nw > 0) & (nv > 0), g1(np.abs(nw)) * g1(np.abs(nv)) * d * fresnel(wh, psi), 0)


def lobe_reflectance(phi, psi, n=200_000):
    """Bihemispherical reflectance of the lobe: light directions drawn by D, views by the cosine."""
    u = np.random.default_rng(0).random((n, 3))
    mu = np.sqrt(u[:, 0])
    v = np.stack([np.sqrt(1 - mu**2), 0 * mu, mu], -1)
    c2 = (1 - u[:, 1]) / (1 + (phi**2 - 1) * u[:, 1])
    s, a = np.sqrt(1 - c2), 2 * np.pi * u[:, 2]
    half = np.stack([s * np.cos(a), s * np.sin(a), np.sqrt(c2)], -1)
    vh = (v * half).sum(1)
    w = 2 * vh[:, None] * half - v
    ok = (vh > 1e-4) & (w[:, 2] > 0)
    w, v, vh, c = w[ok], v[ok], vh[ok], np.sqrt(c2[ok])
    density = phi**2 / (np.pi * (1 + (phi**2 - 1) * c**2) ** 2) * c / (4 * vh)
    return (lobe(w, v, np.array([0, 0, 1.0]), phi, psi) * w[:, 2] / density).sum() / n


def disc_mean(pixels):
    """Mean over what the camera sees of an object: an average over views with the cosine as weight."""
    return pixels[..., :3].sum((0, 1)) / pixels[..., 3].sum()


@pytest.mark.parametrize("albedo", [(0.2, 0.5, 0.8), (1.0, 0.02, 0.0)])
def test_furnace_lambertian(scene, shoot, look, white_world, albedo):
    scene.render.film_transparent = True
    add("sphere", make_material(ObjectMaterial(0, "Ball", LAMBERTIAN), plain(albedo)), subdivisions=5)
    look((0, 0, 3))
    np.testing.assert_allclose(disc_mean(shoot(16, 16, 64)), albedo, rtol=0.01, atol=1e-6)


@pytest.mark.parametrize(("phi", "psi"), LOBES)
def test_furnace_specular(scene, shoot, look, white_world, phi, psi):
    """Diffuse part to 1 %, the sum to 3 % (Cycles' true Fresnel and correlated masking differ from the method's)."""
    scene.render.film_transparent = True
    look((0, 0, 3))
    albedo = np.float32([0.2, 0.5, 0.8])
    description = ObjectMaterial(0, "Ball", DIELECTRIC, alpha=phi, f0=psi)
    ball = add("sphere", make_material(description, plain(base_color(albedo[None], psi, phi)[0])), subdivisions=5)
    whole = disc_mean(shoot(16, 16, 400))
    ball.data.materials[0] = make_material(description, plain((0, 0, 0)))
    specular = disc_mean(shoot(16, 16, 400))
    np.testing.assert_allclose(whole - specular, albedo, rtol=0.01)
    expected = albedo + lobe_reflectance(phi, psi)
    print(
        f"phi {phi} psi {psi}: specular {specular.mean():.4f}, method {expected[0] - 0.2:.4f}; whole {whole / expected}"
    )
    np.testing.assert_allclose(whole, expected, rtol=0.03)


def test_furnace_metal(scene, shoot, look, white_world):
    scene.render.film_transparent = True
    look((0, 0, 3))
    f0 = np.array([0.9, 0.6, 0.3])
    add("sphere", make_material(ObjectMaterial(0, "Tap", METAL, alpha=0.05, f0=tuple(f0))), subdivisions=5)
    expected = [lobe_reflectance(0.05, x) for x in f0]
    np.testing.assert_allclose(disc_mean(shoot(16, 16, 400)), expected, rtol=0.05)


def lamp_points(half, height, centre=(0.0, 0.0), n=12):
    """Midpoints of a square lamp's cells, (n * n, 3), and the area of each."""
    x = (np.arange(n) + 0.5) / n * 2 * half - half
    x, y = np.meshgrid(x, x)
    return np.stack([x.ravel() + centre[0], y.ravel() + centre[1], np.full(n * n, height)], -1), (2 * half / n) ** 2


def test_lamp_over_a_plane(scene, shoot, look):
    radiance, albedo = np.array([30.0, 20.0, 5.0]), np.array([0.2, 0.5, 0.8])
    add("plane", make_material(ObjectMaterial(0, "Floor", LAMBERTIAN), plain(albedo)), size=4)
    add(
        "plane",
        make_material(ObjectMaterial(1, "Lamp", EMITTER, emission=tuple(radiance))),
        size=0.5,
        location=(0.3, 0, 2),
    )
    points, area = lamp_points(0.25, 2.0, (0.3, 0.0))
    distance2 = (points**2).sum(1)
    irradiance = (radiance * (area * points[:, 2:] ** 2 / distance2[:, None] ** 2)).sum(0)
    look((0, 0, 1), width=0.05)
    got = shoot(8, 8, 64)[..., :3].mean((0, 1))
    print("lamp over a plane, got / analytic", got / (irradiance * albedo / np.pi))
    np.testing.assert_allclose(got, irradiance * albedo / np.pi, rtol=0.01)


def test_emission_is_exact_from_both_sides(scene, shoot, look, white_world):
    radiance = (31.5, 7.25, 0.0)
    add("plane", make_material(ObjectMaterial(0, "Lamp", EMITTER, emission=radiance)), size=4)
    for place, rotation in (((0, 0, 1), (0, 0, 0)), ((0, 0, -1), (np.pi, 0, 0))):
        look(place, rotation)
        got = shoot(4, 4, 4)[..., :3].reshape(-1, 3).mean(0)
        np.testing.assert_allclose(got, np.add(radiance, LAMP_ALBEDO), rtol=1e-5, atol=1e-6)


def test_a_one_sided_lamp_is_dark_from_behind(scene, shoot, look):
    radiance = (31.5, 7.25, 0.0)
    description = ObjectMaterial(0, "Lamp", EMITTER, emission=radiance)
    add("plane", make_material(description, one_sided=True), size=4)
    for place, rotation, expected in (((0, 0, 1), (0, 0, 0), radiance), ((0, 0, -1), (np.pi, 0, 0), (0, 0, 0))):
        look(place, rotation)
        seen = shoot(4, 4, 4)[..., :3].reshape(-1, 3).mean(0)
        np.testing.assert_allclose(seen, expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(("phi", "psi"), LOBES)
def test_highlight_profile(scene, shoot, look, phi, psi):
    """The highlight of a small lamp on a plane, seen at 45 degrees, pixel by pixel against the method's G D F.

    Cycles has true Fresnel where the method has Schlick: at psi 0.04 and 45 degrees that is 18 % more. With the same
    Fresnel only the masking differs, height-correlated in Cycles, and the agreement is to 1 % of the peak.
    """
    size, width, half, height = 24, 3.0, 0.1, 2.0
    lamp = (0.0, 2.0)
    add("plane", make_material(ObjectMaterial(0, "Table", DIELECTRIC, alpha=phi, f0=psi), plain((0, 0, 0))), size=20)
    add(
        "plane",
        make_material(ObjectMaterial(1, "Lamp", EMITTER, emission=(100.0,) * 3)),
        size=2 * half,
        location=(*lamp, height),
    )
    look((0, -4, 4), (np.pi / 4, 0, 0), width=width)
    got = shoot(size, size, 100)[..., 1]
    view = np.array([0, -1, 1]) / np.sqrt(2)
    across = ((np.arange(size * 2) + 0.5) / (size * 2) - 0.5) * width
    x, y = np.meshgrid(across, -across * np.sqrt(2))
    points, area = lamp_points(half, height, lamp, 6)
    w = points - np.stack([x, y, 0 * x], -1)[:, :, None]
    distance2 = (w**2).sum(-1)
    w /= np.sqrt(distance2)[..., None]
    normal = np.array([0, 0, 1.0])
    light = w[..., 2] ** 2 / distance2 * area * 100
    view = np.broadcast_to(view, w.shape)
    for name, fresnel in (("Schlick", schlick), ("Fresnel", dielectric)):
        expected = (lobe(w, view, normal, phi, psi, fresnel) * light).sum(-1).reshape(size, 2, size, 2).mean((1, 3))
        rms = np.sqrt(np.mean((got - expected) ** 2)) / expected.max()
        total = got.sum() / expected.sum()
        print(f"phi {phi} psi {psi} {name}: peak {got.max() / expected.max():.3f}, sum {total:.3f}, rms {rms:.4f}")
        assert rms < (0.07 if name == "Schlick" else 0.01)
        assert total == pytest.approx(1, abs=0.2 if name == "Schlick" else 0.02)
