"""What the artist gives, put onto what was found: a known white, base colours; and what is assumed for want of either.

A known white says by how much E is off, as albedo = pi L_d / E and L_d was measured. So E is scaled, channel by
channel, and the albedo of the whole room with it. The light that the scene is rendered under has to make up for it:
what other surfaces send is measured and stays, so all of the difference is laid on lamps, sky and sun (`of_light`).
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..brdf.material import ObjectMaterial, base_colors, with_metals
from ..evidence.collect import Evidence, collect
from ..evidence.findings import Findings
from ..evidence.light import spots
from ..light.over_surface import RayCounts, irradiance
from ..light.sun import Sun, insert_sun
from ..luminance import rgb
from ..passes.albedo.albedo import MEASURED, Albedo, albedo_of
from ..passes.albedo.albedo import NONE as NO_ALBEDO
from ..results.overrides import Overrides
from ..scene.atlas import Atlas
from ..significance import LEVELS
from .params import CORRECTED
from .published import light as published_light
from .stages import Stages

RAYS: RayCounts = {"rays": 64, "emitter_rays": 32, "portal_rays": 32}


@dataclass(frozen=True)
class WhiteScale:
    """What a known white says.

    Attributes
    ----------
    of_irradiance : (3,) float32
        E is to be multiplied by this; albedo is divided by it.
    of_light : (3,) float32
        Lamps, sky and sun are to be multiplied by this, so that a render of the room shows L_d as before.
    warning : str
        '' if nothing is doubtful.
    """

    of_irradiance: np.ndarray
    of_light: np.ndarray
    warning: str = ""


class Corrected(Stages):
    """What is made of the stages' results: the final E, albedo and materials, and how sure they are."""

    @cached_property
    def emitters(self) -> set[int]:
        """Objects that have no albedo, as they are lamps: found, or given."""
        return {m.object_id for m in self.specular().materials if m.model.gives_light}

    def materials(self) -> list[ObjectMaterial]:
        """One description for each instance."""
        return self._materials

    @cached_property
    def _materials(self) -> list[ObjectMaterial]:
        light = np.ones(3) if self.white is None else self.white.of_light
        return corrected(self.specular().materials, self.overrides, light)

    @cached_property
    def white(self) -> WhiteScale | None:
        """What a known white says of the light; None if none is given."""
        return white_scale(self)

    @property
    def irradiance_found(self) -> np.ndarray:
        """E before a known white is heeded, (n, 3) float32."""
        return self.shading().irradiance + self.specular().excess

    @cached_property
    def irradiance(self) -> np.ndarray:
        """The final E, (n, 3) float32."""
        return self.irradiance_found if self.white is None else self.irradiance_found * self.white.of_irradiance

    @cached_property
    def albedo(self) -> Albedo:
        """The final albedo: of L_d less its specular part, under all that glossy things reflect, and as given."""
        return self.albedo_of_all_but(self.emitters)

    def albedo_of_all_but(self, without: set[int]) -> Albedo:
        """The same, but with none for some objects."""
        specular = self.specular()
        see_through = [m.object_id for m in specular.materials if m.model.see_through]
        albedo = self.albedo_under(self.irradiance, without)
        # What shows its background has no albedo that was measured.
        origin = np.where(np.isin(self.surface().atlas.object_id, see_through), np.int8(NO_ALBEDO), albedo.origin)
        return with_base_colors(replace(albedo, origin=origin), self.surface().atlas, self.overrides)

    def albedo_under(self, irradiance: np.ndarray, without: set[int]) -> Albedo:
        """The albedo that L_d less its specular part has under an E, (n, 3) float32; the objects `without` get none."""
        atlas, instances, found = self.surface().atlas, self.capture.instances, self.specular()
        if "shading" in self.settings.published:
            return published_light.albedo_of(atlas, found.rest, irradiance, instances, without)
        return albedo_of(
            atlas, found.rest, irradiance, self.shading().relative_error, instances, without, self.settings.without
        )

    def base_color(self) -> np.ndarray:
        """Base Color of each element for Cycles' Principled, (n, 3) float32."""
        return self.base_color_of(self.albedo.rho, self.surface().atlas.object_id)

    def base_color_of(self, rho: np.ndarray, object_id: np.ndarray) -> np.ndarray:
        """The same of any albedo ((k, 3) float32) of objects ((k,) int), (k, 3) float32."""
        described = with_metals if "compensation" in self.settings.without else base_colors
        return described(rho, object_id, self.materials())

    @property
    def findings(self) -> Findings:
        """All that was found; asks for every stage."""
        self.shading()
        return Findings(
            name=self.capture.root.name,
            instances=self.capture.instances,
            frames=self.frames,
            surface=self.surface(),
            lit_diffuse=self.lit_diffuse(),
            samples=self.observed().samples,
            shading=self.shading(),
            field=self.field,
            specular=self.specular().specular,
            irradiance=self.irradiance,
            albedo=self.albedo,
            materials=self.materials(),
            coloured=frozenset(i for i, override in self.overrides.objects.items() if override.base_color is not None),
            threads=self.settings.threads,
            seed=self.settings.seed,
        )

    @cached_property
    def evidence(self) -> Evidence:
        """How sure all of it is."""
        return collect(self.findings)

    @property
    def sun(self) -> Sun | None:
        """The sun that frames show or that was solved for, before a known white is heeded."""
        return self.specular().sun or self.shading().sun

    def sky(self) -> np.ndarray:
        """Radiance from outside with the sun in it, (h, w, 3) float32, row 0 the bottom."""
        sky = insert_sun(self.shading().environment, self.sun)
        return sky if self.white is None else sky * self.white.of_light


def white_scale(run: Corrected) -> WhiteScale | None:
    """What the known white of a run, whose stages are done, says; None if none is given."""
    white = run.overrides.white
    if white is None:
        return None
    atlas, ones = run.surface().atlas, np.ones(3, np.float32)
    object_name = next(i.name for i in run.capture.instances if i.object_id == white.object_id)
    name = object_name if white.at is None else f"the spot of {object_name}"
    before, scale = run.irradiance_found, ones
    others = {i.object_id for i in run.capture.instances} - {white.object_id}
    for _ in range(CORRECTED.rounds):
        albedo = run.albedo_under(before * scale, others)
        chosen = (atlas.object_id == white.object_id) & (albedo.origin == MEASURED)
        if white.at is not None:
            chosen &= (
                np.linalg.norm(atlas.position - np.array(white.at, np.float32), axis=1)
                < CORRECTED.around * atlas.texel_edge
            )
        mean = np.average(albedo.rho[chosen], 0, atlas.area[chosen]) if chosen.any() else np.zeros(3)
        if white.object_id in run.emitters or mean.min() <= 0:
            message = f"No albedo of {name} was measured, so it can't be the white; it was left out."
            return WhiteScale(ones, ones, message)
        scale = (scale * mean / np.asarray(white.albedo)).astype(np.float32)
    direct = _direct_share(run)
    light = np.maximum(1 + (scale - 1) / direct, CORRECTED.least_light).astype(np.float32)
    warning = ""
    if scale.max() > CORRECTED.doubtful or scale.min() < 1 / CORRECTED.doubtful:
        factors = ", ".join(f"{factor:.2f}" for factor in scale)
        warning = (
            f"The white of {name} scales the light by {factors} (red, green, blue); that is much: is it that white?"
        )
    return WhiteScale(scale, light, warning)


def _direct_share(run: Corrected) -> np.ndarray:
    """Share of E, (3,), that comes from lamps, sky and sun, over what was seen of the room."""
    field, seen = run.field, run.lit_diffuse().seen
    chosen, _ = spots(field.atlas, seen, LEVELS.sample, run.settings.seed)
    chosen = chosen[seen[chosen]]
    lamps = np.isin(field.atlas.object_id, [lamp.object_id for lamp in run.shading().lamps])
    direct = field.with_light(np.where(lamps[:, None], field.radiance, np.float32(0)))
    direct_irradiance = irradiance(
        direct, chosen, **RAYS, interpolate=False, finest=1.0, threads=run.settings.threads, seed=run.settings.seed
    )[0]
    total_irradiance = run.irradiance_found[chosen]
    area = field.atlas.area[chosen, None]
    return np.clip((area * direct_irradiance).sum(0) / np.maximum((area * total_irradiance).sum(0), 1e-20), 0.05, 1)


def with_base_colors(albedo: Albedo, atlas: Atlas, overrides: Overrides) -> Albedo:
    """The albedo with the given base colours as means over what was measured; texture is kept as variation about."""
    given = {i: override.base_color for i, override in overrides.objects.items() if override.base_color is not None}
    if not given:
        return albedo
    rho, error = albedo.rho.copy(), albedo.error.copy()
    for object_id, colour in given.items():
        elements = atlas.elements_of(object_id)
        measured = albedo.origin[elements] == MEASURED
        rho[elements] = _coloured(rho[elements], measured, atlas.area[elements], np.asarray(colour, np.float32))
        error[elements] = 0
    return replace(albedo, rho=rho, error=error)


def _coloured(rho: np.ndarray, measured: np.ndarray, area: np.ndarray, colour: np.ndarray) -> np.ndarray:
    """Albedo (k, 3) scaled to a mean `colour` over the elements `measured`; constant where there are none."""
    if not measured.any():
        return np.broadcast_to(colour, rho.shape)
    for _ in range(CORRECTED.rounds):  # what is clamped at 1 lowers the mean
        mean = np.average(rho[measured], 0, area[measured])
        rho = np.where(mean < LEVELS.dark, colour, np.minimum(rho * (colour / np.maximum(mean, LEVELS.dark)), 1))
    return rho.astype(np.float32)


def corrected(materials: tuple[ObjectMaterial, ...], overrides: Overrides, light: np.ndarray) -> list[ObjectMaterial]:
    """Descriptions with what was given, and lamps under the `light` ((3,)) that a known white asks for."""
    result = []
    for m in materials:
        given = overrides.of(m.object_id)
        m = replace(m, given=given.as_dict())
        if m.emission is not None:
            m = replace(m, emission=rgb(np.asarray(m.emission) * light))
        if m.model.lobe_alone and given.base_color is not None and given.f0 is None:
            mean = float(np.mean(given.base_color))
            m = replace(m, f0=m.model.as_f0(given.base_color), f0_low=mean, f0_high=mean)
        result.append(m)
    return result
