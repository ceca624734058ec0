"""The page's pictures of one frame: seen, predicted, recovered, and how sure it is."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ..kinds import Shown
from ..photo import encoded, photo
from ..significance import LEVELS
from .colours import NOTHING, gloss, heat
from .findings import Findings
from .texel import TexelEvidence
from .views import View

ERROR_TOP: Shown[float] = 0.5
RESIDUAL_TOP: Shown[float] = 0.5
VIEWS_TOP: Shown[int] = 20
"""What lies at the bright end of the heat maps: relative errors, and the number of views."""
WORST: Shown[int] = 3
BLOCK: Shown[int] = 12
"""Edge in pixels of the squares among which the worst residuals are sought."""
MARK: Shown[tuple[int, int, int]] = (0, 255, 200)


@dataclass(frozen=True)
class Picture:
    """One picture of the page.

    Attributes
    ----------
    image : (h, w, 3) uint8
    legend : str
        Of heat maps: from what to what; '' for others.
    """

    title: str
    image: np.ndarray
    legend: str = ""


def pictures_of(findings: Findings, errors: TexelEvidence, view: View) -> tuple[list[Picture], list[tuple[int, float]]]:
    """Pictures of a frame, and its worst residuals: (object_id, mean relative residual) from the worst on."""
    element, empty = view.element, view.element < 0
    index = np.maximum(element, 0)
    albedo, shading = findings.albedo.rho, findings.irradiance
    median = float(np.median(view.radiance[view.valid])) if view.valid.any() else 1.0
    emitters = np.isin(view.object_id, list(findings.emitters))

    relative = errors.albedo[index].mean(-1) / np.maximum(albedo[index].mean(-1), LEVELS.dark)
    residual = view.residual
    worst = worst_blocks(residual, view.object_id)
    light = shading[index]
    grey = float(np.median(light[~empty].mean(-1))) if not empty.all() else 1.0
    metals = {m.object_id: m.f0 for m in findings.materials if m.model.lobe_alone}
    blank = empty | emitters | np.isin(view.object_id, list(metals))
    colour = _where(empty | emitters, encoded(albedo[index]))
    for object_id, f0 in metals.items():
        colour[view.object_id == object_id] = encoded(np.array(f0))
    views = _where(empty, heat(findings.lit_diffuse.count[index], VIEWS_TOP))
    residual = _boxed(heat(residual, RESIDUAL_TOP), worst)
    unsure = _where(blank, heat(relative, ERROR_TOP))
    pictures = [
        Picture("Frame", photo(view.radiance, median)),
        Picture("Predicted from what was recovered", photo(view.predicted, median)),
        Picture("Residual; boxes: the worst", residual, _up_to(f"{RESIDUAL_TOP:.0%}")),
        Picture("Albedo; of metals F0", colour),
        Picture("Albedo's standard error, relative", unsure, _up_to(f"{ERROR_TOP:.0%}")),
        Picture("Light that arrives (shading)", _where(empty, photo(light, grey))),
        Picture("Views of each spot", views, _up_to(VIEWS_TOP)),
        Picture("Model, lighter the glossier", _models(findings, view)),
    ]
    objects = [(int(view.object_id[y + BLOCK // 2, x + BLOCK // 2]), size) for y, x, size in worst]
    return pictures, objects


def _up_to(top) -> str:
    return f"0 to {top} and more"


def worst_blocks(residual: np.ndarray, object_id: np.ndarray) -> list[tuple[int, int, float]]:
    """Corner (y, x) and mean of the squares with the largest residual, no two of one object."""
    if min(residual.shape) <= BLOCK:
        return []
    mean = ndimage.uniform_filter(residual.astype(np.float32), BLOCK, mode="constant")
    half = BLOCK // 2
    mean[:half], mean[-half:], mean[:, :half], mean[:, -half:] = 0, 0, 0, 0
    blocks: list[tuple[int, int, float]] = []
    while len(blocks) < WORST and mean.max() > 0:
        y, x = np.unravel_index(np.argmax(mean), mean.shape)
        blocks.append((int(y) - half, int(x) - half, float(mean[y, x])))
        mean[object_id == object_id[y, x]] = 0
        mean[max(y - BLOCK, 0) : y + BLOCK, max(x - BLOCK, 0) : x + BLOCK] = 0
    return blocks


def _boxed(image: np.ndarray, corners: list[tuple[int, int, float]]) -> np.ndarray:
    for y, x, _ in corners:
        image[[y, y + BLOCK - 1], x : x + BLOCK] = MARK
        image[y : y + BLOCK, [x, x + BLOCK - 1]] = MARK
    return image


def _where(empty: np.ndarray, image: np.ndarray) -> np.ndarray:
    image[empty] = NOTHING
    return image


def _models(findings: Findings, view: View) -> np.ndarray:
    image = np.full((*view.object_id.shape, 3), NOTHING, np.uint8)
    for m in findings.materials:
        image[view.object_id == m.object_id] = gloss(m.model.colour, m.alpha)
    return image
