"""The page, its pictures, and the PNGs they come as."""

from __future__ import annotations

import re
from html.parser import HTMLParser

import numpy as np
import pytest

from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.evidence.colours import HEAT, heat
from addon.core.evidence.pictures import BLOCK, worst_blocks
from addon.core.io.oiio import read_coded
from addon.core.io.png import png
from addon.core.passes.specular.intervals import UNKNOWN, gloss_interval
from addon.core.passes.specular.models import Choice, choose_model
from addon.core.photo import encoded, photo
from tests.core.glossy_box import Box
from tests.core.rooms import pixels_of


@pytest.mark.parametrize("size", [(1, 1), (3, 5), (40, 30)])
def test_a_png_holds_the_picture(size, tmp_path):
    image = np.random.default_rng(0).integers(0, 256, (*size, 3), np.uint8)
    (tmp_path / "a.png").write_bytes(png(image))
    assert np.array_equal(read_coded(tmp_path / "a.png").colour, image)


def test_colours():
    assert encoded(np.array([0.0, 0.2140, 1.0, np.nan])).tolist() == [0, 127, 255, 0]
    assert np.array_equal(heat(np.array([0.0, 9.0, np.inf]), 1.0), HEAT[[0, -1, -1]].astype(np.uint8))
    brightness = heat(np.linspace(0, 1, 50), 1.0).sum(1)
    assert (np.diff(brightness.astype(int)) > 0).all()
    assert 90 < photo(np.full(3, 2.0), 2.0)[0] < 140


def test_the_worst_residuals_are_found_once_for_each_object():
    residual = np.zeros((60, 80), np.float32)
    residual[10:30, 10:30], residual[40:55, 50:70] = 0.5, 0.8
    owner = np.where(np.arange(80) < 40, 1, 2)[None].repeat(60, 0)
    found = worst_blocks(residual, owner)
    assert len(found) == 2 and [round(size, 2) for _, _, size in found] == [0.8, 0.5]
    y, x, _ = found[0]
    assert 40 <= y <= 55 - BLOCK and 50 <= x <= 70 - BLOCK


def test_frames_are_made_small_by_means():
    image = np.arange(7 * 9 * 3, dtype=np.float32).reshape(7, 9, 3)
    valid = np.ones((7, 9), bool)
    valid[0, 0] = False
    small = pixels_of(image, valid).coarser(2)
    assert small.radiance.shape == (3, 4, 3) and np.allclose(small.radiance[1, 1], image[2:4, 2:4].mean((0, 1)))
    assert not small.valid[0, 0] and small.valid.sum() == 11


@pytest.mark.parametrize("phi", [0.08, 0.2])
def test_the_interval_of_a_highlight_holds_it(phi):
    box = Box()
    element, direction, _ = box.views(120, 8)
    problem = box.problem(element, direction, phi, 0.05, np.full((len(element), 3), 0.2))
    found = gloss_interval(choose_model(problem), problem)
    assert found.roughness[0] <= np.sqrt(phi) <= found.roughness[1]
    assert found.specular[0] <= 0.05 <= found.specular[1]
    assert found.roughness[1] - found.roughness[0] < 0.4 and found.specular[1] < 0.2


def test_what_shows_no_highlight_has_any_roughness():
    box = Box()
    element, direction, _ = box.views(120, 8)
    problem = box.problem(element, direction, None, 0, np.full((len(element), 3), 0.2))
    choice = choose_model(problem)
    assert gloss_interval(choice, problem) == UNKNOWN == gloss_interval(Choice(LAMBERTIAN, None), None)
    assert choice.scores["lambertian"] == 1 and choice.scores["specular"] > 0.9


class Checker(HTMLParser):
    """Counts what is open, and collects what is referred to."""

    VOID = {"meta", "img", "link", "br"}

    def __init__(self):
        super().__init__()
        self.open, self.addresses, self.tags = [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.addresses += [value for name, value in attrs if name in ("src", "href")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def check_page(text: str) -> Checker:
    """Well formed, in itself, without a script."""
    found = Checker()
    found.feed(text)
    assert found.open == [] and "script" not in found.tags
    assert all(address.startswith("data:image/png;base64,") for address in found.addresses)
    assert not re.search(r"https?://", text)
    return found


def _shown(f0: float | None) -> str:
    return "unknown " if f0 is None else f"{f0:.2f} "


@pytest.mark.slow
def test_the_page_of_a_run(tmp_path):
    from addon.core.io.read import read_capture
    from addon.core.pipeline.recover import Recovery
    from addon.core.progress import Progress
    from addon.core.results.store import Store
    from tests.core.on_disk import CHEAP, OnDisk

    disk = OnDisk(tmp_path / "<cap & ture>")
    with Store(tmp_path / "result") as store:
        run = Recovery(read_capture(disk.root), store, CHEAP, Progress(), disk.unwrap)
        run.specular()
        run.write_images()
        sure = run.report()["figures"]["evidence"]
        told = [one for one in run.materials() if one.f0_low is not None]
    text = (tmp_path / "result" / "report.html").read_text(encoding="utf-8")
    page = check_page(text)
    assert page.tags.count("img") == 3 * 8 and "&lt;cap &amp; ture&gt;" in text
    assert text.count("<tr>") == 2 + 6 + 1
    assert told and all(f"<td>{_shown(m.f0)}<small>{m.f0_low:.2f}&ndash;{m.f0_high:.2f}</small>" in text for m in told)
    assert 0 < sure["albedo_error_median"] < 0.15 and sure["unseen_light_mean"] < 0.05
