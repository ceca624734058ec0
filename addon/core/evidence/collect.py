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


def collect(found: Findings) -> Evidence:
    """The evidence of a finished recovery; a few thousand spots are gathered at again."""
    atlas, lit, albedo = found.surface.atlas, found.lit_diffuse, found.albedo
    own = without_light(atlas, lit, albedo)
    light = light_evidence(found.field, found.shading, lit, own, threads=found.threads, seed=found.seed)
    texels = texel_evidence(atlas, lit, albedo, own, light, found.materials, found.specular, found.irradiance)
    texels.albedo[np.isin(atlas.object_id, list(found.coloured))] = 0
    return Evidence(light, texels, object_evidence(atlas, lit, albedo, texels))
