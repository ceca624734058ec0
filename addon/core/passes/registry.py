"""The passes that correct the published method, by name: what each does, and the first stage that it changes.

Any of them can be left out (`Settings.without`); what each gains: docs/ablation.md.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from ..errors import BadInputError
from ..stages import RUN_STAGES


@dataclass(frozen=True)
class Pass:
    """One pass.

    Attributes
    ----------
    name : str
    does : str
        One sentence.
    stage : str
        The first stage whose result it changes, of `stages.RUN_STAGES`.
    """

    name: str
    does: str
    stage: str


def _of(stage: str, **does: str) -> tuple[Pass, ...]:
    return tuple(Pass(name.replace("_", "-"), sentence, stage) for name, sentence in does.items())


PASSES = (
    *_of(
        "surface",
        mesh_denoising="Takes a scan's noise out of its vertices.",
        unfolding="Where triangles are smaller than the noise, draws points towards their neighbours first.",
        angle_variance="Weights dihedral angles by their variance, from draws of the posterior.",
        sheets="Puts what lies in flat parts into their planes.",
        cracks="Closes cracks that the noise opened between parts that only touch.",
        two_sides="Gives triangles that frames see from both sides a second side of its own.",
    ),
    *_of(
        "lit_diffuse",
        pose_refinement="Puts frames right that lie beside what all of them show together.",
        sharpening="Takes the projection's blur out of the lit diffuse texture.",
        edge_tier="Uses observations at depth edges only where there are too few others.",
    ),
    *_of(
        "shading",
        clipped_lamps="Solves for lamps that the sensor clipped, from the light that they send.",
        fringe_colours="Takes the colour of clipped lamps from the pixels along their edges.",
        unseen_lamps="Solves for lamps that no frame sees.",
        unseen_sky="Solves for the parts of the sky that no frame sees.",
        whole_sky="Solves for the sky where no frame sees any of it.",
        shades="Follows light inside lampshades that no frame sees into.",
        joint_light="Refines all solved lamps and sky together.",
        sun="Solves for a sun that no frame sees from the patch of light that it makes.",
        seen_sun="Takes a sun that frames see out of the environment map and treats it by itself.",
        mirrors="Finds flat mirrors and follows light over them.",
        emitter_rays="Aims rays at bright triangles.",
        portal_rays="Aims rays at the openings to the outside.",
        interpolation="Gathers irradiance at few points and interpolates between them.",
        lamp_noise="Takes the aimed rays' noise out of the lamps' irradiance.",
        crease_error="Counts irradiance beside creases as less certain.",
        tilt_error="Counts irradiance on triangles that noise has turned as less certain.",
        unseen_surfaces="Lets what no frame sees reflect like the rest of its object.",
    ),
    *_of(
        "specular",
        first_look="Drops hopeless lobes after a cheap first fit.",
        more_rays="Traces more rays for observations whose reflected light is noisy.",
        grazing="Lets the diffuse part darken towards grazing views.",
        ray_noise="Takes the rays' noise out of the least squares for the lobe.",
        dielectric_prior="Gives the specular weight of dielectrics a prior.",
        see_through="Sets apart what is transparent or cut out.",
        metal_by_looks="Tells metals of one colour from all of their surface.",
        coat_by_looks="Tells coated things of one colour from all of their surface.",
        class_lobes="Shares lobes among objects of one class.",
        specular_removal="Takes the fitted specular part out of every observation, and the median of what is left.",
        glossy_light="Lights the room by what glossy things really reflect.",
        caustics="Follows light from bright triangles over glossy things by photons.",
        glossy_smoothing="Takes noise out of the glossy things' light.",
    ),
    *_of(
        "write",
        albedo_prior="Draws uncertain albedo towards its neighbourhood's.",
        second_colour="Draws it to a second colour of the neighbourhood where that is likelier.",
        wide_prior="Widens the neighbourhood for as long as it stays alike.",
        object_spread="Takes the spread of single observations from others of the object.",
        compensation="Raises Base Color for the light that the Principled coat keeps from the diffuse part.",
        coat="Gives objects that were hardly seen a plausible coat.",
    ),
)  # fmt: skip
"""All of them in the order of the stages."""
STAGE_OF = {one.name: one.stage for one in PASSES}


def check(without: Collection[str]) -> None:
    """Raise `BadInputError` for a name that is no pass's."""
    for name in without:
        if name not in STAGE_OF:
            raise BadInputError(f"There is no pass '{name}' to leave out; choose among {', '.join(STAGE_OF)}.")


def left_out_of(stage: str, without: Collection[str]) -> tuple[str, ...]:
    """Those passes left out that change `stage` first: a part of its key."""
    assert stage in RUN_STAGES
    return tuple(name for name in sorted(without) if STAGE_OF[name] == stage)
