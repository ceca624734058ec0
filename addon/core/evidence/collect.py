"""All evidence of a finished recovery."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .light import LightEvidence, light_evidence
from .objects import ObjectEvidence, object_evidence
from .texel import TexelEvidence, texel_evidence, without_light

if TYPE_CHECKING:
    from ..pipeline.recover import Recovery


@dataclass(frozen=True)
class Evidence:
    """How sure a recovery is.

    Attributes
    ----------
    light : LightEvidence
    texels : TexelEvidence
    objects : list of ObjectEvidence
    """

    light: LightEvidence
    texels: TexelEvidence
    objects: list[ObjectEvidence]

    def images(self) -> dict[str, np.ndarray]:
        """What is written as pictures, (n, 3) float32 each, by name: see docs/result_folder.md."""
        t = self.texels
        return {"albedo_error": t.albedo, "evidence": np.stack([t.shading, t.clipped, t.unseen], -1)}


def collect(run: Recovery) -> Evidence:
    """The evidence of a run whose stages are done; a few thousand spots are gathered at again."""
    atlas, lit, shading, specular = run.surface().atlas, run.lit_diffuse(), run.shading(), run.specular()
    own = without_light(atlas, lit, run.albedo)
    light = light_evidence(run.field, shading, lit, own, threads=run.settings.threads, seed=run.settings.seed)
    texels = texel_evidence(
        atlas, lit, run.albedo, own, light, list(specular.materials), specular.specular, run.irradiance
    )
    given = [i for i, one in run.overrides.objects.items() if one.base_color is not None]
    texels.albedo[np.isin(atlas.object_id, given)] = 0
    return Evidence(light, texels, object_evidence(atlas, lit, run.albedo, texels))
