"""Every lens projects as COLMAP does, and its inverse undoes it over the whole image."""

import json
import math

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.scene.lens_json import lens_from_json, lens_to_json
from addon.core.scene.lenses import Cropped, Division, EnhancedUnified, Equirectangular, FieldOfView
from addon.core.scene.lenses_colmap import COUNTS, intrinsics, polynomial
from addon.core.scene.model import Camera
from addon.core.scene.pixel_rays import pixel_rays, widest_angle

WIDTH, HEIGHT = 1152, 768
RAYS = np.array([(0.31, -0.22, 1.0), (-0.62, 0.41, 1.0), (0.9, 0.5, 0.8)])
# Parameters after the principal point, and where pycolmap 4.2.1 sees RAYS with f 600 (620 for fy), c (580.3, 383.1).
SEEN_BY_COLMAP = {
    "SIMPLE_PINHOLE": ((), [(766.3, 251.1), (208.3, 629.1), (1255.3, 758.1)]),
    "PINHOLE": ((), [(766.3, 246.7), (208.3, 637.3), (1255.3, 770.6)]),
    "SIMPLE_RADIAL": ((0.1,), [(768.9877, 249.1926), (187.747, 642.6915), (1367.096875, 820.209375)]),
    "RADIAL": ((-0.2, 0.05), [(761.118786, 254.77699), (243.728234, 605.671652), (1124.288037, 685.315576)]),
    "OPENCV": (
        (-0.3, 0.1, 0.002, -0.003),
        [(757.855533, 252.881049), (255.615048, 604.973576), (1099.222949, 684.76542)],
    ),
    "OPENCV_FISHEYE": (
        (0.05, -0.01, 0.003, -0.0005),
        [(759.188641, 251.914997), (254.337549, 605.841008), (1074.906876, 667.040984)],
    ),
    "FULL_OPENCV": (
        (0.3, -0.1, 0.001, 0.002, 0.01, 0.4, -0.05, 0.01),
        [(763.895171, 248.680291), (231.305094, 622.375452), (1131.055524, 699.16037)],
    ),
    "FOV": ((0.9,), [(771.649494, 242.777038), (233.987339, 619.746985), (1100.975773, 682.006462)]),
    "SIMPLE_RADIAL_FISHEYE": (
        (-0.05,),
        [(756.872876, 257.790217), (266.934959, 590.325269), (1037.928769, 637.338205)],
    ),
    "RADIAL_FISHEYE": ((-0.05, 0.01), [(756.903827, 257.768252), (266.400929, 590.678418), (1041.205741, 639.158745)]),
    "THIN_PRISM_FISHEYE": (
        (0.03, -0.01, 0.001, -0.002, 0.002, -0.0004, 0.001, -0.0015),
        [(758.354598, 252.427659), (255.819597, 604.534099), (1065.152788, 661.469953)],
    ),
    "RAD_TAN_THIN_PRISM_FISHEYE": (
        (0.03, -0.01, 0.005, -0.002, 0.0004, -3e-05, 0.001, -0.002, 0.001, -0.0003, 0.0007, 0.0002),
        [(759.133374, 251.965224), (258.19921, 603.208226), (1068.084623, 662.004789)],
    ),
    "SIMPLE_DIVISION": ((-0.2,), [(761.214522, 254.709049), (242.246188, 606.651714), (1114.996862, 680.153812)]),
    "DIVISION": ((0.1,), [(769.068299, 244.669914), (185.10392, 653.150655), (1434.218298, 873.312356)]),
    "SIMPLE_FISHEYE": ((), [(758.045635, 256.957936), (260.399739, 594.646947), (1057.705297, 648.325165)]),
    "FISHEYE": ((), [(758.045635, 252.753201), (260.399739, 601.698512), (1057.705297, 657.166004)]),
    "EUCM": ((0.6, 1.1), [(758.132638, 252.689399), (259.826524, 602.090209), (1059.735333, 658.331395)]),
    "EQUIRECTANGULAR": ((), [(631.114996, 333.366759), (474.243479, 465.968672), (730.772674, 480.211473)]),
}
STRONG = {
    "barrel that folds": polynomial("RADIAL", numerator=(-0.45, 0.0)),
    "barrel and back": polynomial("OPENCV", numerator=(-0.4, 0.2), tangential=(0.01, -0.008)),
    "pincushion": polynomial("SIMPLE_RADIAL", numerator=(0.9,)),
    "rational with a pole": polynomial("FULL_OPENCV", numerator=(0.1,), denominator=(-0.3,)),
    "a pole that is not round": polynomial("FULL_OPENCV", denominator=(0.25, -0.25, 0.0), tangential=(0.01, 0.0)),
    "a pole of two roots": polynomial("FULL_OPENCV", numerator=(0.045,), denominator=(-2 * 0.8261, 0.8261**2)),
    "fisheye past 180 degrees": polynomial("OPENCV_FISHEYE", fisheye=True, numerator=(-0.02, 0.004, -0.001, 0.0001)),
    "fisheye that folds": polynomial("RADIAL_FISHEYE", fisheye=True, numerator=(-0.15, 0.0)),
    "prism": polynomial("THIN_PRISM_FISHEYE", fisheye=True, numerator=(0.05, -0.02), tangential=(0.008, -0.01),
                        prism=(0.01, 0.0, -0.012, 0.0)),
    "Aria": polynomial("RAD_TAN_THIN_PRISM_FISHEYE", fisheye=True, chained=True, tangential=(-0.004, 0.003),
                       numerator=(-0.024, 0.1, -0.07, 0.012, 0.001, -0.0003), prism=(0.002, -0.0003, 0.001, 0.0001)),
    "narrow FOV": FieldOfView(0.001),
    "wide FOV": FieldOfView(2.5),
    "division inwards": Division(-0.8),
    "division outwards": Division(0.35),
    "EUCM forward": EnhancedUnified(0.3, 0.8),
    "EUCM behind": EnhancedUnified(0.85, 1.4),
    "EUCM paraboloid": EnhancedUnified(1.0, 1.0),
    "panorama": Equirectangular(),
    "cropped fisheye": Cropped(polynomial("FISHEYE", fisheye=True), 1.2, 1.1),
}  # fmt: skip


def told(name):
    """A model's parameters as COLMAP's files have them."""
    if name == "EQUIRECTANGULAR":
        return [WIDTH, HEIGHT]
    extra, _ = SEEN_BY_COLMAP[name]
    single = COUNTS[name] - len(extra) == 3
    return [600.0] + ([] if single else [620.0]) + [580.3, 383.1, *extra]


def camera(lens, f=400.0, width=WIDTH, height=HEIGHT):
    if isinstance(lens, Equirectangular):
        return Camera(width, height, width / 2 / math.pi, height / math.pi, width / 2, height / 2, np.eye(4), lens)
    return Camera(width, height, f, 1.05 * f, 0.503 * width, 0.49 * height, np.eye(4), lens)


def cone(lens, count=20000):
    """Rays all over the cone that the lens sees, some of them not of unit length."""
    rng = np.random.default_rng(3)
    theta = np.concatenate([[0, 1e-9, 1e-6], rng.uniform(0, min(lens.widest, math.radians(89.5)
                            if lens.widest <= math.pi / 2 else lens.widest), count)])  # fmt: skip
    phi = rng.uniform(0, 2 * np.pi, len(theta))
    rays = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    return rays * rng.uniform(0.1, 9, (len(theta), 1))


@pytest.mark.parametrize("name", SEEN_BY_COLMAP)
def test_projects_as_colmap(name):
    fx, fy, cx, cy, lens = intrinsics(name, told(name), WIDTH, HEIGHT)
    pose = np.diag([1.0, -1, -1, 1])  # COLMAP's axes
    pixels, depth = Camera(WIDTH, HEIGHT, fx, fy, cx, cy, pose, lens).project(RAYS)
    assert (depth > 0).all()
    # COLMAP cuts its series for FOV short.
    np.testing.assert_allclose(pixels, SEEN_BY_COLMAP[name][1], atol=1e-5 if name == "FOV" else 2e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", SEEN_BY_COLMAP)
def test_every_pixel_comes_back(name):
    one = Camera(
        WIDTH,
        HEIGHT,
        *intrinsics(name, told(name), WIDTH, HEIGHT)[:4],
        np.eye(4),
        intrinsics(name, told(name), WIDTH, HEIGHT).lens,
    )
    back, depth = one.project(np.stack(pixel_rays(one)[0], -1))
    seen = pixel_rays(one)[1]
    seen = np.ones(len(back), bool) if seen is None else seen.ravel()
    assert seen.mean() > 0.99
    assert (depth[seen] > 0).all()
    np.testing.assert_allclose(back[seen], one.pixel_centres()[seen], atol=1e-6, rtol=0)


@pytest.mark.parametrize("name", STRONG)
def test_strong_lenses_come_back_or_tell(name):
    lens = STRONG[name]
    one = camera(lens, 133.0, 384, 256)
    points = (one.pixel_centres() - (one.cx, one.cy)) / (one.fx, one.fy)
    rays, seen = lens.unproject(points)
    assert np.isfinite(rays).all() and seen[len(seen) // 2 + 192]
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1, atol=1e-12)
    back, again = lens.project(rays[seen])
    np.testing.assert_allclose(back, points[seen], atol=1e-6 / 133, rtol=0)
    # A point on the very rim may fall on either side of it.
    assert again.mean() > 0.9999
    assert (np.arccos(np.clip(rays[seen, 2], -1, 1)) <= lens.widest + 1e-6).all()


@pytest.mark.parametrize("name", STRONG)
def test_rays_come_back(name):
    lens = STRONG[name]
    rays = cone(lens)
    points, seen = lens.project(rays)
    assert np.isfinite(points).all()
    if name != "cropped fisheye":
        assert seen.mean() > (0.9 if lens.widest < math.pi / 2 or not hasattr(lens, "radial") or lens.radial else 0.5)
    back, again = lens.unproject(points[seen])
    assert again.mean() > 0.9995
    unit = rays[seen] / np.linalg.norm(rays[seen], axis=1, keepdims=True)
    off = np.linalg.norm(np.cross(back, unit), axis=1)[again]
    # Where a pixel covers a wide angle (a fold, 90 degrees of a perspective), a thousandth of it covers much as well.
    magnified = 1e-9 / np.maximum(np.abs(np.cos(lens.widest)), 1e-3)
    assert np.percentile(off, 99) < magnified and (np.einsum("ij,ij->i", back, unit)[again] > 0.99).all()


@pytest.mark.parametrize("name", STRONG)
def test_no_two_rays_share_a_point(name):
    """Neighbouring pixels' rays turn the same way round all over the image: the map has no fold."""
    one = camera(STRONG[name], 250.0, 192, 128)
    local, seen = pixel_rays(one)
    rays = local.reshape(3, 128, 192).transpose(1, 2, 0)
    right, down = rays[:-1, 1:] - rays[:-1, :-1], rays[1:, :-1] - rays[:-1, :-1]
    turn = np.einsum("ijk,ijk->ij", np.cross(right, down), rays[:-1, :-1])
    if seen is not None:
        turn = turn[seen[:-1, :-1] & seen[:-1, 1:] & seen[1:, :-1]]
    assert len(turn) and (turn > 0).all()


def test_beyond_the_fold_nothing_is_seen():
    lens = polynomial("RADIAL", numerator=(-0.3,))
    fold = 1 / math.sqrt(0.9)  # 1 = 3 * 0.3 r^2
    assert math.tan(lens.widest) == pytest.approx(fold, rel=1e-9)
    edge = fold * (1 - 0.3 * fold**2)
    rays = np.array([[fold * 0.999, 0, 1], [fold * 1.001, 0, 1], [0, 0, -1.0], [0.1, 0, -1]])
    assert lens.project(rays)[1].tolist() == [True, False, False, False]
    assert lens.unproject(np.array([[0, edge * 0.9999], [0, edge * 1.0001]]))[1].tolist() == [True, False]


@pytest.mark.parametrize("tangential", [(-0.6, 0.0), (0.0, -0.6), (0.3, 0.1)])
def test_points_that_no_ray_meets_are_given_up(tangential, monkeypatch):
    """The lens is asked at some tens of places for each point, not until all steps are used up (140 and more)."""
    lens = polynomial("OPENCV", numerator=(0.0, 0.0), tangential=tangential)
    points = np.random.default_rng(0).uniform(-1.6, 1.6, (5000, 2))
    asked, real = [], type(lens)._off
    monkeypatch.setattr(type(lens), "_off", lambda self, u, *more: asked.append(len(u)) or real(self, u, *more))
    rays, seen = lens.unproject(points)
    assert 0 < seen.sum() < len(points) and sum(asked) < 40 * len(points)
    np.testing.assert_allclose(lens.project(rays[seen])[0], points[seen], atol=1e-9)


def test_fisheyes_see_behind():
    lens = polynomial("FISHEYE", fisheye=True)
    points, seen = lens.project(np.array([[math.sin(2), 0, math.cos(2)]]))
    assert seen.all()
    np.testing.assert_allclose(points, [[2, 0]], atol=1e-12)
    assert not lens.unproject(np.array([[3.2, 0]]))[1].any()


def test_panorama_looks_all_round():
    one = camera(Equirectangular(), width=400, height=200)
    # OpenGL axes: right, up, behind, left, ahead
    rays = np.array([[1.0, 0, 0], [0, 1, 0], [0.001, 0, 1], [-1, 0, 0], [0, 0, -1]])
    pixels, depth = one.project(rays)
    assert (depth > 0).all()
    np.testing.assert_allclose(pixels[[0, 3, 4]], [[300, 100], [100, 100], [200, 100]], atol=1e-9)
    assert pixels[1, 1] == pytest.approx(0) and pixels[2, 0] == pytest.approx(400, abs=0.1)


@pytest.mark.parametrize("name", STRONG)
def test_pixel_angles_sum_to_the_solid_angle(name):
    """Each pixel's area on the sphere, against the rays of its neighbours."""
    one = camera(STRONG[name], 250.0, 192, 128)
    local, _ = pixel_rays(one)
    rays = local.reshape(3, 128, 192)
    angles = one.pixel_angles(one.pixel_centres()).reshape(128, 192)[1:-1, 1:-1]
    sides = (rays[:, 1:-1, 2:] - rays[:, 1:-1, :-2]) / 2, (rays[:, 2:, 1:-1] - rays[:, :-2, 1:-1]) / 2
    area = np.linalg.norm(np.cross(*sides, axis=0), axis=0)
    good = angles > 0
    inner = good & (np.abs(np.mgrid[-63:63, -95:95]).max(0) < 40)
    np.testing.assert_allclose(angles[inner] ** 2, area[inner], rtol=0.02)
    assert 0.2 < one.pixel_angle * 250 < 2.5 or name == "panorama"


@pytest.mark.parametrize("name", STRONG)
def test_no_pixel_lies_beyond_the_widest_angle(name):
    one = camera(STRONG[name], 300.0, 96, 64)
    rng = np.random.default_rng(0)
    rays, seen = one.rays(rng.uniform(0, 1, (5000, 2)) * (95, 63) + 0.5)
    angle = np.arccos(np.clip(-rays[seen, 2].astype(float), -1, 1))
    assert (angle <= widest_angle(one) + 1e-3).all()


@pytest.mark.parametrize("lens", [None, *STRONG.values()], ids=["none", *STRONG])
def test_told_and_read_again(lens):
    assert lens_from_json(json.loads(json.dumps(lens_to_json(lens)))) == lens
    assert hash(lens) == hash(lens_from_json(lens_to_json(lens)))


@pytest.mark.parametrize(("name", "values", "wrong"), [
    ("KANNALA", [1], "none of COLMAP's"),
    ("OPENCV", [600, 600, 1, 1], "takes 8 parameters and 4"),
    ("PINHOLE", [600, -600, 1, 1], "above 0"),
    ("PINHOLE", [600, math.nan, 1, 1], "not finite"),
    ("EUCM", [600, 600, 1, 1, 1.5, 1], "alpha"),
    ("FOV", [600, 600, 1, 1, 4], "omega"),
])  # fmt: skip
def test_impossible_parameters_are_told(name, values, wrong):
    with pytest.raises(BadInputError, match=wrong):
        intrinsics(name, values, WIDTH, HEIGHT)


@pytest.mark.parametrize("name", ["SIMPLE_RADIAL", "OPENCV", "FULL_OPENCV", "FOV", "DIVISION", "EUCM"])
def test_no_distortion_is_a_pinhole(name):
    values = [500.0] * (1 if COUNTS[name] == 4 else 2) + [320, 240]
    values += [0.0] * (COUNTS[name] - len(values))
    if name == "EUCM":
        values[-1] = 1.0
    assert intrinsics(name, values, 640, 480).lens is None
