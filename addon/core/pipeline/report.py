"""What report.json holds: how the run went, what it found, and what to be wary of, one sentence each."""

import dataclasses
from typing import Any

import numpy as np

from ..evidence.tier import tier
from ..origin import package_of
from ..passes.albedo.albedo import MEASURED, above_one, quotient, without_emitters
from ..passes.registry import following
from ..scene.visibility import SATURATED
from .corrected import Corrected


def make_report(run: Corrected) -> dict[str, Any]:
    """Stages, settings, figures and warnings of what has been computed so far."""
    result: dict[str, Any] = {
        "capture": run.capture.root.name,
        "tier": tier(run.capture),
        "settings": dataclasses.asdict(run.settings),
        "stages": run.log,
        "passes_of_packages": [
            {"name": item.name, "stage": item.stage, "package": item.origin or package_of(item.run)}
            for stage in run.done
            for item in following(stage, run.settings.without)
        ],
        "warnings": [*run.capture.warnings, *map(_recomputed, run.store.damaged), *run.read.bad],
    }
    figures: dict[str, Any] = {"frames": len(run.capture.frames), "triangles": len(run.capture.mesh.triangles)}
    if "surface" in run.done:
        surface = run.surface()
        figures |= {"atlas_size": surface.atlas.size, "elements": len(surface.atlas)}
        figures["texel_metres"] = surface.texel_size
        _report_surface(run, figures, result["warnings"])
    if "lit_diffuse" in run.done:
        _report_lit_diffuse(run, figures, result["warnings"])
    if "shading" in run.done:
        _report_shading(run, figures, result["warnings"])
    if "specular" in run.done:
        models = [m.model.name for m in run.materials()]
        figures["models"] = {model: models.count(model) for model in sorted(set(models))}
        figures["evidence"] = _evidence_figures(run)
        if run.white is not None:
            figures["white_scale"] = [float(x) for x in run.white.of_irradiance]
            figures["white_light"] = [float(x) for x in run.white.of_light]
            result["warnings"] += [run.white.warning] if run.white.warning else []
    result["figures"] = figures
    return result


def _recomputed(stage: str) -> str:
    return (
        f"The stage '{stage}' in the result folder was damaged, or changed since it was written; it was done anew. "
        "If nobody changed it, check the disk."
    )


def _evidence_figures(run: Corrected) -> dict[str, float]:
    """How sure the room is as a whole; medians and means over the elements, lamps left out."""
    evidence, albedo = run.evidence, run.albedo
    relative = evidence.texels.albedo.mean(1) / np.maximum(albedo.rho.mean(1), 1e-3)
    reflecting = ~np.isin(run.surface().atlas.object_id, list(run.emitters))
    measured, filled = reflecting & (albedo.origin == MEASURED), reflecting & (albedo.origin != MEASURED)
    kinds = {"": measured, "filled_": filled}
    figures = {f"albedo_error_{name}median": float(np.median(relative[k])) for name, k in kinds.items() if k.any()}
    if measured.any():
        figures["shading_error_median"] = float(np.median(evidence.texels.shading[measured]))
        figures["unseen_light_mean"] = float(evidence.texels.unseen[measured].mean())
    return figures | {"spots_checked": evidence.light.spots}


def _report_surface(run: Corrected, figures: dict[str, Any], warnings: list[str]) -> None:
    surface = run.surface()
    _, area = surface.mesh.geometry
    figures["two_sided_share"] = float(area[surface.backs].sum() / area.sum())
    figures["mesh_noise_metres"] = surface.noise
    closed = float(area[surface.mesh.closed].sum()) if surface.mesh.closed is not None else 0.0
    figures["closed_square_metres"] = closed
    if closed:
        warnings.append(
            f"{closed:.1f} square metres of holes in the mesh's floor, walls and other planes were closed; "
            "leave the pass close-holes out to keep them open."
        )
    if surface.noise:
        captured = run.capture.mesh.vertices
        moved = np.linalg.norm(run.room_mesh().vertices[: len(captured)] - captured, axis=1)
        warnings.append(
            f"The mesh has noise of {1000 * surface.noise:.1f} mm along its normals; it was smoothed, edges kept, its "
            f"vertices moved by {1000 * np.sqrt(np.mean(moved**2)):.1f} mm; turn off denoise_mesh to use it as it is."
        )


def _report_lit_diffuse(run: Corrected, figures: dict[str, Any], warnings: list[str]) -> None:
    lit_diffuse, atlas = run.lit_diffuse(), run.surface().atlas
    if run.read.blind:
        count, first = len(run.read.blind), run.read.blind[0]
        warnings.append(f"{count} frames have no valid pixel (the first: {first}); all are NaN, inf or masked.")
    if not lit_diffuse.radiance[lit_diffuse.seen].any():
        warnings.append("Every frame is black; nothing can be said of any albedo.")
    calibration = run.observed().calibration
    if calibration.calibrated.any():
        exposure = np.log2(calibration.gain[calibration.calibrated].mean(1))
        figures |= {
            "calibrated_frames": int(calibration.calibrated.sum()),
            "exposure_range_stops": float(np.ptp(exposure)),
            "calibration_spread": float(calibration.spread),
            "mean_white_balance": np.exp(np.log(calibration.gain[calibration.calibrated]).mean(0)).tolist(),
        }
    poses = run.observed().poses
    if np.isfinite(poses.shift):
        figures |= {"pose_shift_pixels": float(poses.shift), "poses_refined": int(poses.moved.sum())}
    if poses.moved.any():
        warnings.append(
            f"Frames lay {poses.shift:.1f} pixels beside what all of them show together; the poses of "
            f"{poses.moved.sum()} of {len(poses.moved)} were put right; turn off refine_poses to use them as read."
        )
    area = atlas.area.sum()
    figures["unseen_share"] = float(atlas.area[~lit_diffuse.seen].sum() / area)
    figures["observations_median"] = (
        float(np.median(lit_diffuse.count[lit_diffuse.seen])) if run.capture.frames else 0.0
    )
    figures["lit_from"] = "frames" if run.capture.frames else "textures on the mesh"
    seen = np.bincount(atlas.object_id, lit_diffuse.seen, int(atlas.object_id.max()) + 1)
    unseen = [i for i in run.capture.instances if i.object_id >= len(seen) or seen[i.object_id] == 0]
    if unseen:
        names = ", ".join(i.name for i in unseen[:5])
        more = f" and {len(unseen) - 5} more" if len(unseen) > 5 else ""
        warnings.append(f"No frame sees {names}{more}; their materials are taken from their class or the room.")
    clipped = float(atlas.area[lit_diffuse.tier == SATURATED].sum() / area)
    if clipped > 0:
        figures["clipped_share"] = clipped
        warnings.append(f"{clipped:.1%} of the surface is clipped in every frame that sees it; no albedo is had of it.")
    if not run.observed().environment.seen:
        figures["outside"] = "no frame sees past the mesh"


def _report_shading(run: Corrected, figures: dict[str, Any], warnings: list[str]) -> None:
    shading, lit_diffuse = run.shading(), run.lit_diffuse()
    escaped = float(shading.escaped[lit_diffuse.seen].mean())
    # Before the specular part is known; a clipped element has no quotient.
    rho, valid = quotient(lit_diffuse.radiance, shading.irradiance)
    measurable = without_emitters(
        run.surface().atlas, lit_diffuse.seen & (lit_diffuse.tier != SATURATED), shading.emitters
    )
    above = above_one(rho, measurable & valid)
    figures |= {
        "escaped_share": escaped,
        "albedo_above_one_share": above,
        "shading_points": shading.points,
        "lamps": [lamp.object_id for lamp in shading.lamps],
        "mirrors": [mirror.object_id for mirror in shading.mirrors],
        "parts": shading.patches.parts.tolist(),
    }
    if shading.openings is not None:
        figures["unknown_light_share"] = float(shading.openings.share)
    sun = run.sun if "specular" in run.done else shading.sun
    if sun is not None:
        figures["sun"] = {"direction": [float(x) for x in sun.direction], "seen": sun.seen,
                          "irradiance": [float(x) for x in sun.irradiance]}  # fmt: skip
    names = {instance.object_id: instance.name for instance in run.capture.instances}
    warnings += [f"Lamp '{names[lamp.object_id]}': {note}" for lamp in shading.lamps if (note := lamp.note(names))]
    warnings += [*shading.notes, *([] if sun is None else [sun.note])]
    if above > 0.05:
        warnings.append(
            f"{above:.0%} of the seen surface would need an albedo above 1: light is missing "
            "(an unseen lamp, a clipped one, or a hole that was no window)."
        )
    figures["unlit_share"] = float((measurable & ~valid).sum() / max(lit_diffuse.seen.sum(), 1))
    if figures["unlit_share"] > 0.001:
        warnings.append(
            f"{figures['unlit_share']:.1%} of the seen surface gets too little light for an albedo; it was filled in."
        )
    if escaped > 0.02 and not run.observed().environment.seen and not shading.environment.radiance.any():
        warnings.append(
            f"{escaped:.0%} of the rays leave the mesh, but no frame sees what lies there; it was taken as dark."
        )
