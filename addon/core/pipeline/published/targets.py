"""The lobe of each object, from its target frame."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...brdf.dielectric import DIELECTRIC
from ...brdf.lambertian import LAMBERTIAN
from ...brdf.material import ObjectMaterial
from ...fit.lobe_fit import LobeFit
from ...paper.recover import fit_object, usable
from ...passes.specular.describe import described
from ...passes.specular.intervals import gloss_interval
from ...passes.specular.models import Choice
from ...scene.model import Instance
from ..choose_models import Room


def fit_targets(instances: Sequence[Instance], room: Room) -> dict[int, ObjectMaterial]:
    """A lobe for each of these objects, from its target frame; diffuse where no frame can be one."""
    field, radiance, samples, settings = room.field, room.lit_diffuse.radiance, room.samples, room.settings
    names = room.frame_names

    def look(instance: Instance) -> ObjectMaterial:
        index = usable(samples, field.atlas.object_id, instance.object_id)
        target_fit = fit_object(
            field,
            field.atlas,
            radiance,
            samples,
            index,
            len(names),
            settings.specular_rays,
            threads=settings.threads,
            seed=settings.seed,
        )
        if target_fit is None:
            note = "No frame shows enough of it."
            return ObjectMaterial(instance.object_id, instance.class_name, LAMBERTIAN, note=note)
        diffuse = radiance[samples.element[target_fit.index]]
        level = np.maximum(diffuse.mean(1), 1e-12)
        residuals = target_fit.lobe.residual, samples.radiance[target_fit.index] - diffuse
        residual, unexplained = (float(np.median(np.sqrt(np.square(x).mean(1)) / level)) for x in residuals)
        psi = np.full(3, target_fit.lobe.psi)
        choice = Choice(DIELECTRIC, LobeFit(target_fit.lobe.phi, psi, 0.0, 0.0, residual, unexplained))
        name = names[target_fit.frame]
        material = described(instance, choice, None, name, gloss_interval(choice, None))
        return replace(material, observations=len(target_fit.index))

    materials = {}
    for instance in instances:
        materials[instance.object_id] = look(instance)
        if room.progress is not None:
            room.progress.update(0.7 * len(materials) / len(instances))
    return materials
