"""What is known of each object as a whole: how much of it was seen, and its mean albedo with an interval."""

from dataclasses import dataclass

import numpy as np

from ..brdf.material import Z90
from ..groups import by_label
from ..luminance import rgb
from ..passes.albedo.albedo import MEASURED
from .findings import Findings
from .params import CALIBRATION
from .texel import TexelEvidence


@dataclass(frozen=True)
class ObjectEvidence:
    """One object.

    Attributes
    ----------
    area : float
        Square metres.
    seen_share, measured_share : float
        Shares of its area that any frame saw, and whose albedo was measured.
    clipped_share : float
        Of its observations, those that the sensor clipped.
    observations : float
        Behind a spot's L_d, in the median over what was seen; 0 if nothing was.
    albedo, albedo_low, albedo_high : (3,) tuple of float
        Mean over what was measured (else over all of it), and its 90 % interval.
    shading_error : float
        Relative standard error of E, in the median over what was seen, else over all.
    unseen_light : float
        Share of E that comes from what no frame saw, in the mean over the same.
    """

    object_id: int
    area: float
    seen_share: float
    measured_share: float
    clipped_share: float
    observations: float
    albedo: tuple[float, float, float]
    albedo_low: tuple[float, float, float]
    albedo_high: tuple[float, float, float]
    shading_error: float
    unseen_light: float


def object_evidence(findings: Findings, texels: TexelEvidence) -> list[ObjectEvidence]:
    """One for each object that has elements, by object_id."""
    return [_evidence_of(elements, findings, texels) for elements in by_label(findings.surface.atlas.object_id)]


def _evidence_of(elements: np.ndarray, findings: Findings, texels: TexelEvidence) -> ObjectEvidence:
    atlas, lit, albedo = findings.surface.atlas, findings.lit_diffuse, findings.albedo
    area = atlas.area[elements].astype(np.float64)
    seen, measured = lit.seen[elements], albedo.origin[elements] == MEASURED
    total = max(float(area.sum()), 1e-30)
    averaged = elements[measured] if measured.any() else elements
    weight = atlas.area[averaged] / max(float(atlas.area[averaged].sum()), 1e-30)
    mean = weight @ albedo.rho[averaged]
    error = CALIBRATION.of_object * np.sqrt(weight @ np.square(texels.albedo[averaged]))
    observed = elements[seen] if seen.any() else elements
    return ObjectEvidence(
        object_id=int(atlas.object_id[elements[0]]),
        area=total,
        seen_share=float((area * seen).sum() / total),
        measured_share=float((area * measured).sum() / total),
        clipped_share=float(texels.clipped[observed].mean()),
        observations=float(np.median(lit.count[observed])),
        albedo=_rounded(mean),
        albedo_low=_rounded(np.maximum(mean - Z90 * error, 0)),
        albedo_high=_rounded(np.minimum(mean + Z90 * error, 1)),
        shading_error=float(np.median(texels.shading[observed])),
        unseen_light=float(texels.unseen[observed].mean()),
    )


def _rounded(values: np.ndarray) -> tuple[float, float, float]:
    return rgb(round(float(x), 5) for x in values)
