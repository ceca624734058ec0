"""A result against a room's truth, without rendering: scores, and which stage an object's error comes from.

The albedo of an element is pi L_d / E. The truth's views hold E / pi (diffuse_light) and the albedo (diffuse_color), so
for each object the median of estimate / truth is known for the albedo, for L_d and for E, channel by channel.
"""

import json
from pathlib import Path

import numpy as np

from addon.benchmark.truth_materials import found_roughness, score_materials, true_kind, true_roughness
from addon.benchmark.truth_views import pairs, psnr, views
from addon.core.io.exr import read_exr
from addon.core.io.read import read_capture
from addon.core.passes.albedo.albedo import MEASURED
from addon.core.pipeline.recover import Recovery
from addon.core.progress import Progress
from addon.core.results.store import Store
from addon.core.settings import Settings

from .held import interval_coverage, projected_truth


def table(capture: Path, result: Path) -> str:
    """All figures as text; RESULT/qa.json gets them too."""
    figures = compare(capture, result)
    (result / "qa.json").write_text(json.dumps(figures, indent=1))
    lines = [f"{capture.name}"]
    lines += [f"  {value:6.2f} dB  {name}" for name, value in figures["psnr"].items()]
    lines += [
        f"  {figures['roughness_by_pixel']:6.3f}     roughness, mean absolute error by pixel",
        f"  {figures['roughness_by_object']:6.3f}     roughness, mean absolute error by object",
        f"  models right: {figures['right']} of {figures['of']}: {figures['models']}",
        f"  90 % intervals hold: {', '.join(f'{name} {value:.2f}' for name, value in figures['held'].items())}",
    ]
    for lamp in figures["lamps"]:
        lines.append(
            f"  lamp {lamp['id']} {lamp['class_name']}: {_channels(lamp['found'])} (true {_channels(lamp['true'])})"
            f" {'seen' if lamp['seen'] else 'unseen'} {lamp['note']}"
        )
    lines += [f"  note: {note}" for note in figures["notes"] + figures["warnings"]]
    lines.append(
        "  objects, worst first: pixels, share of the squared error; estimate / truth of albedo | of L_d less its "
        "specular part | of the median itself | of E; measured share; model found/true, roughness found/true, F0"
    )
    for row in figures["objects"]:
        lines.append(
            f"  {row['id']:3d} {row['class_name'][:15]:15s} {row['pixels']:6d} {row['share']:6.1%}  "
            f"{' | '.join(_channels(row[kind]) for kind in ('albedo', 'L_d', 'median', 'E'))}  {row['measured']:4.0%}  "
            f"{row['model']}/{row['true_model']} {_mean(row['roughness'])}/{_mean(row['true_roughness'])} "
            f"{_mean(row['f0'])}"
        )
    return "\n".join(lines) + "\n"


def _channels(x) -> str:
    return "   -  " if x is None else " ".join(f"{v:5.2f}" for v in x)


def _mean(x) -> str:
    return "-" if x is None else f"{np.mean(x):.2f}"


def compare(capture: Path, result: Path) -> dict:
    """The figures of `table`, as plain values."""
    settings = Settings(**json.loads((result / "report.json").read_text())["settings"])
    truth = {o["id"]: o for o in json.loads((capture / "truth" / "materials.json").read_text())}
    with Store(result) as store:
        recovery = Recovery(read_capture(capture), store, settings, Progress(), None)
        held_out = views(capture, recovery)
        lit, shading, specular = recovery.lit_diffuse(), recovery.shading(), recovery.specular()
        base, rho, E = recovery.base_color(), recovery.albedo.rho, recovery.irradiance
        materials = {m.object_id: m for m in recovery.materials()}
        measured = recovery.albedo.origin == MEASURED
        warnings, shares = recovery.report()["warnings"], interval_coverage(recovery, held_out, truth)
    for view, frame in zip(held_out, json.loads((capture / "truth" / "transforms.json").read_text())["frames"]):
        name = Path(frame["file_path"]).name
        for kind in ("diffuse_light", "diffuse_color"):
            path = capture / "truth" / kind / name
            view[kind] = read_exr(path).rgb.reshape(-1, 3) if path.exists() else np.full_like(view["truth"], np.nan)
    object_ids = np.concatenate([view["id"] for view in held_out])
    pixels = {i: int((object_ids == i).sum()) for i in truth}
    quantities = {"albedo": rho, "L_d": np.maximum(lit.radiance - specular.specular, 0), "median": lit.radiance, "E": E}
    ratios, share = _ratios(held_out, quantities, base, truth)
    scores = {"Base Color as written": psnr(held_out, base)}
    scores |= _scaled(held_out, base)
    scores["on measured elements only"] = psnr(held_out, base, measured)
    scores["the truth itself through the texels"] = psnr(held_out, projected_truth(held_out, len(E), base))
    ids_of = recovery.surface().atlas.object_id
    for name, kinds in (("E", ("E",)), ("L_d", ("L_d",)), ("E and L_d", ("E", "L_d"))):
        corrected = base.copy()
        for i, ratio in ratios.items():
            elements = ids_of == i
            for kind in kinds:
                if ratio.get(kind) is not None:
                    corrected[elements] *= np.asarray(ratio[kind]) if kind == "E" else 1 / np.maximum(ratio[kind], 0.05)
        scores[f"Base Color with each object's {name} put right (one factor a channel)"] = psnr(held_out, corrected)
    rows, scored = [], score_materials(materials.values(), truth, pairs(held_out))
    for i, true in truth.items():
        material = materials[i]
        elements = np.isin(ids_of, [i])
        rows.append({
            "id": i, "class_name": true["class_name"], "pixels": pixels[i], "share": share.get(i, 0.0),
            **{k: ratios.get(i, {}).get(k) for k in quantities},
            "measured": float(measured[elements].mean()) if elements.any() else 0.0,
            "model": material.model.name, "true_model": true_kind(true),
            "roughness": found_roughness(material), "true_roughness": true_roughness(true),
            "f0": material.f0,
            "true_f0": true["base_color"] if true["metallic"] and "base_color" in true else None,
            "scores": material.scores, "note": material.note,
        })  # fmt: skip
    lamps = {lamp.object_id: lamp for lamp in shading.lamps}
    names = {instance.object_id: instance.name for instance in recovery.capture.instances}
    lamp_rows = [
        {
            "id": i,
            "class_name": truth[i]["class_name"],
            "true": truth[i]["emission"],
            "found": lamps[i].radiance.tolist() if i in lamps else None,
            "seen": lamps[i].seen if i in lamps else False,
            "note": lamps[i].note(names) if i in lamps else "",
        }
        for i in truth
        if truth[i]["emission"] or i in lamps
    ]
    return {
        "psnr": scores,
        "roughness_by_pixel": scored.roughness_by_pixel,
        "roughness_by_object": scored.roughness_by_object,
        "held": shares,
        "models": scored.models,
        "of": scored.objects,
        "right": scored.right,
        "lamps": lamp_rows,
        "notes": list(shading.notes),
        "warnings": list(warnings),
        "mirrors": [m.object_id for m in shading.mirrors],
        "objects": sorted(rows, key=lambda row: -row["share"]),
    }


def _true_values(held_out: list[dict], key: str) -> np.ndarray:
    """The views' true values at the pixels that count, concatenated."""
    return np.concatenate([view[key][view["counts"]] for view in held_out])


def _estimates(held_out: list[dict], values: np.ndarray) -> np.ndarray:
    """The elements' values at the same pixels."""
    return np.concatenate([values[view["element"]].mean(0)[view["counts"]] for view in held_out])


def _scaled(held_out: list[dict], base: np.ndarray) -> dict[str, float]:
    """PSNR after one scale, and after one for each channel."""
    estimate, true = _estimates(held_out, base).astype(np.float64), _true_values(held_out, "truth").astype(np.float64)
    scale = (estimate * true).sum() / (estimate * estimate).sum()
    scales = (estimate * true).sum(0) / (estimate * estimate).sum(0)
    return {
        f"after one scale ({scale:.3f})": psnr(held_out, base * np.float32(scale)),
        f"after three scales ({', '.join(f'{x:.3f}' for x in scales)})": psnr(held_out, base * np.float32(scales)),
    }


def _ratios(held_out, quantities, base, truth) -> tuple[dict, dict]:
    """Median of estimate / truth by object, quantity and channel; and each object's share of the squared error."""
    light, colour, ids = (_true_values(held_out, key) for key in ("diffuse_light", "diffuse_color", "id"))
    true = {"albedo": colour, "L_d": light * colour, "median": light * colour, "E": np.pi * light}
    estimate = {kind: _estimates(held_out, values) for kind, values in quantities.items()}
    error = np.square(np.clip(_estimates(held_out, base), 0, 1) - np.clip(_true_values(held_out, "truth"), 0, 1)).sum(1)
    share = {int(i): float(error[ids == i].sum() / error.sum()) for i in np.unique(ids)}
    ratios = {}
    for i in truth:
        mask = ids == i
        if mask.sum() < 20:
            continue
        ratios[i] = {}
        for kind in quantities:
            a, b = estimate[kind][mask], true[kind][mask]
            finite = np.isfinite(a).all(1) & np.isfinite(b).all(1)
            # The truth's light is noisy: sums over blocks of pixels are compared.
            n = max(1, finite.sum() // 40)
            blocks = np.array_split(np.flatnonzero(finite), n)
            quotient = [a[block].sum(0) / np.maximum(b[block].sum(0), 1e-9) for block in blocks if len(block)]
            ratios[i][kind] = np.median(quotient, 0).tolist() if quotient else None
    return ratios, share
