"""All evidence of a finished recovery."""

from dataclasses import dataclass

import numpy as np

from .findings import Findings
from .light import LightEvidence, light_evidence
from .objects import ObjectEvidence, object_evidence
from .texel import TexelEvidence, texel_evidence, without_light


@dataclass(frozen=True)
class Evidence:
    """How sure a recovery is."""

    light: LightEvidence
    texels: TexelEvidence
    objects: list[ObjectEvidence]

    def shares(self) -> np.ndarray:
        """What the picture 'evidence' shows, (n, 3) float32."""
        return np.stack([self.texels.shading, self.texels.clipped, self.texels.unseen], -1)


def collect(findings: Findings) -> Evidence:
    """The evidence of a finished recovery; E is gathered again at a few thousand elements."""
    intrinsic = without_light(findings)
    light = light_evidence(findings, intrinsic)
    texels = texel_evidence(findings, intrinsic, light)
    texels.albedo[np.isin(findings.surface.atlas.object_id, list(findings.coloured))] = 0
    return Evidence(light, texels, object_evidence(findings, texels))
