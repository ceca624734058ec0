"""Base colour in parts: as the room's image where that shows all, finer where the frames show more."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from addon.core.errors import InterruptedRun
from addon.core.io.exr import read_exr
from addon.core.io.read import read_capture
from addon.core.progress import Progress
from addon.core.results.store import Store
from tests.core.on_disk import ALBEDO, CHEAP, LAMP, OnDisk
from tests.core.rooms import radiosity

pytestmark = pytest.mark.usefixtures("few_samples")
COARSE = replace(CHEAP, texel_size=0.0, atlas_size=64, sharpen=False)
"""The atlas is too small for what the frames show."""
WALLS = range(2, 6)


def stripes(room):
    """Paint of the walls, 0.5 m from stripe to stripe: what the albedo is multiplied by, by element."""
    atlas = room.atlas
    wave = 1 + 0.5 * np.sin(2 * np.pi * atlas.position.sum(1) / 0.5)
    return np.where(np.isin(atlas.object_id, WALLS), wave, 1).astype(np.float32)


@pytest.fixture(scope="module")
def striped(tmp_path_factory):
    def light(room):
        return radiosity(room, ALBEDO, {6: LAMP}) * stripes(room)[:, None]

    return OnDisk(tmp_path_factory.mktemp("striped"), light=light)


def run(disk, folder, **settings):
    """A written result: its recovery."""
    with Store(folder) as store:
        recovery = disk.recovery(store, replace(COARSE, **settings))
        recovery.write_images()
        return recovery


def shown(disk, folder, recovery):
    """What the materials' images show at the true room's elements, (n, 3), and which are the walls', (n,) bool."""
    truth, parts, uv = disk.room.atlas, recovery.parts, recovery.surface().atlas.uv.astype(float)
    at = np.stack([truth.texel % truth.size, truth.texel // truth.size], -1) / truth.size + 0.5 / truth.size
    a, b, c = (uv[truth.triangle, k] for k in range(3))
    found = np.linalg.solve(np.stack([b - a, c - a], -1), (at - a)[..., None])[..., 0]
    weight = np.stack([1 - found.sum(1), *found.T], -1)
    coordinates = uv if parts is None else parts.uv.astype(float)
    at = np.einsum("nk,nkc->nc", weight, coordinates[truth.triangle])
    result = np.full((len(truth), 3), np.nan)
    tile = np.floor(coordinates[truth.triangle].mean(1)).astype(int)
    for number in WALLS:
        own = np.flatnonzero(truth.object_id == number)
        file = "base_color.exr" if parts is None else parts.images[number]
        for column, row in np.unique(tile[own], axis=0):
            here = own[(tile[own] == (column, row)).all(1)]
            image = read_exr(folder / file.replace("<UDIM>", str(1001 + column + 10 * row))).rgb[::-1]
            x, y = ((at[here] - (column, row)) * image.shape[1::-1]).astype(int).T
            result[here] = image[np.clip(y, 0, len(image) - 1), np.clip(x, 0, image.shape[1] - 1)]
    return result, np.isin(truth.object_id, WALLS)


def error(disk, folder, recovery):
    """By how much the stripes are off that the images show, as a share of them."""
    found, walls = shown(disk, folder, recovery)
    wave = stripes(disk.room)[walls]
    owner = disk.room.atlas.object_id[walls]
    found = found[walls].mean(1)
    middle = np.array([np.median(found[owner == number]) for number in owner])
    return float(np.std(found / middle - wave) / np.std(wave))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["object", "udim"])
def test_parts_show_more_than_a_small_atlas_holds(striped, tmp_path, kind):
    room = run(striped, tmp_path)
    before = error(striped, tmp_path, room)
    parted = run(striped, tmp_path, atlas=kind)
    assert room.parts is None and parted.parts is not None
    assert (parted.albedo.rho == room.albedo.rho).all()  # the room's own image is what it was
    after = error(striped, tmp_path, parted)
    print(f"{kind}: error of the stripes {before:.3f} with the room's image, {after:.3f} in parts")
    assert after < 0.85 * before
    told = json.loads((tmp_path / "materials.json").read_text())["objects"]
    assert {one["object_id"]: one.get("image") for one in told} == {i: parted.parts.images.get(i) for i in range(7)}
    assert parted.run_key != room.run_key


@pytest.mark.slow
def test_each_way_takes_the_others_images_away(disk, tmp_path):
    def parts():
        return {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*base_color*.exr")}

    run(disk, tmp_path, atlas="object")
    assert parts() == {"base_color.exr", *(f"objects/thing {i} {i} base_color.exr" for i in range(6))}
    assert run(disk, tmp_path, atlas="udim").parts.tiles == tuple(
        int(name.split(".")[1]) for name in sorted(parts()) if name.count(".") == 2
    )
    assert not any(name.startswith("objects/") for name in parts())
    run(disk, tmp_path)
    assert parts() == {"base_color.exr"}


@pytest.mark.slow
def test_the_look_at_the_frames_is_told_and_stopped_and_done_once(striped, tmp_path):
    def files():
        return {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.[ehj]*")}

    run(striped, tmp_path)
    before, shares = files(), []

    def follow(stop_at):
        shares.clear()
        return Progress(
            lambda event: event.stage == "write" and shares.append(event.share),
            lambda: any(stop_at < share < 0.5 for share in shares),
        )

    def write(kind, stop_at=1.0):
        progress = follow(stop_at)
        with Store(tmp_path) as store:
            recovery = striped.recovery(store, replace(COARSE, atlas=kind), progress)
            recovery.specular()
            progress.stage("write")
            recovery.write_images()

    with pytest.raises(InterruptedRun):
        write("object", stop_at=0.05)
    assert files() == before and len(shares) > 1
    write("object")
    frames = len(read_capture(striped.root).frames)
    assert shares == sorted(shares) and sum(0 < share < 0.3 for share in shares) >= frames
    write("object")
    assert not any(0 < share < 0.3 for share in shares)
