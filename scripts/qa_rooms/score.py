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

from .held import held, projected_truth


def table(capture: Path, result: Path) -> str:
    """All figures as text; RESULT/qa.json gets them too."""
    found = compare(capture, result)
    (result / "qa.json").write_text(json.dumps(found, indent=1))
    lines = [f"{capture.name}"]
    lines += [f"  {value:6.2f} dB  {name}" for name, value in found["psnr"].items()]
    lines += [
        f"  {found['roughness_by_pixel']:6.3f}     roughness, mean absolute error by pixel",
        f"  {found['roughness_by_object']:6.3f}     roughness, mean absolute error by object",
        f"  models right: {found['right']} of {found['of']}: {found['models']}",
        f"  90 % intervals hold: {', '.join(f'{name} {value:.2f}' for name, value in found['held'].items())}",
    ]
    for lamp in found["lamps"]:
        lines.append(
            f"  lamp {lamp['id']} {lamp['class_name']}: {_three(lamp['found'])} (true {_three(lamp['true'])})"
            f" {'seen' if lamp['seen'] else 'unseen'} {lamp['note']}"
        )
    lines += [f"  note: {note}" for note in found["notes"] + found["warnings"]]
    lines.append(
        "  objects, worst first: pixels, share of the squared error; estimate / truth of albedo | of L_d less its "
        "specular part | of the median itself | of E; measured share; model found/true, roughness found/true, F0"
    )
    for row in found["objects"]:
        lines.append(
            f"  {row['id']:3d} {row['class_name'][:15]:15s} {row['pixels']:6d} {row['share']:6.1%}  "
            f"{' | '.join(_three(row[kind]) for kind in ('albedo', 'L_d', 'median', 'E'))}  {row['measured']:4.0%}  "
            f"{row['model']}/{row['true_model']} {_one(row['roughness'])}/{_one(row['true_roughness'])} "
            f"{_one(row['f0'])}"
        )
    return "\n".join(lines) + "\n"


def _three(x) -> str:
    return "   -  " if x is None else " ".join(f"{v:5.2f}" for v in x)


def _one(x) -> str:
    return "-" if x is None else f"{np.mean(x):.2f}"


def compare(capture: Path, result: Path) -> dict:
    """What `table` shows, as plain values."""
    settings = Settings(**json.loads((result / "report.json").read_text())["settings"])
    truth = {o["id"]: o for o in json.loads((capture / "truth" / "materials.json").read_text())}
    with Store(result) as store:
        recovery = Recovery(read_capture(capture), store, settings, Progress(), None)
        seen = views(capture, recovery)
        lit, shading, specular = recovery.lit_diffuse(), recovery.shading(), recovery.specular()
        base, rho, E = recovery.base_color(), recovery.albedo.rho, recovery.irradiance
        materials = {m.object_id: m for m in recovery.materials()}
        measured = recovery.albedo.origin == MEASURED
        warnings, shares = recovery.report()["warnings"], held(recovery, seen, truth)
    for view, frame in zip(seen, json.loads((capture / "truth" / "transforms.json").read_text())["frames"]):
        name = Path(frame["file_path"]).name
        for kind in ("diffuse_light", "diffuse_color"):
            path = capture / "truth" / kind / name
            view[kind] = read_exr(path).rgb.reshape(-1, 3) if path.exists() else np.full_like(view["truth"], np.nan)
    every = np.concatenate([view["id"] for view in seen])
    pixels = {i: int((every == i).sum()) for i in truth}
    split = {"albedo": rho, "L_d": np.maximum(lit.radiance - specular.specular, 0), "median": lit.radiance, "E": E}
    ratios, share = _ratios(seen, split, base, truth)
    scores = {"Base Color as written": psnr(seen, base)}
    scores |= _scaled(seen, base)
    scores["on measured elements only"] = psnr(seen, base, measured)
    scores["the truth itself through the texels"] = psnr(seen, projected_truth(seen, len(E), base))
    ids_of = recovery.surface().atlas.object_id
    for name, kinds in (("E", ("E",)), ("L_d", ("L_d",)), ("E and L_d", ("E", "L_d"))):
        fixed = base.copy()
        for i, ratio in ratios.items():
            own = ids_of == i
            for kind in kinds:
                if ratio.get(kind) is not None:
                    fixed[own] *= np.asarray(ratio[kind]) if kind == "E" else 1 / np.maximum(ratio[kind], 0.05)
        scores[f"Base Color with each object's {name} put right (one factor a channel)"] = psnr(seen, fixed)
    rows, scored = [], score_materials(materials.values(), truth, pairs(seen))
    for i, true in truth.items():
        mine = materials[i]
        own = np.isin(ids_of, [i])
        rows.append({
            "id": i, "class_name": true["class_name"], "pixels": pixels[i], "share": share.get(i, 0.0),
            **{k: ratios.get(i, {}).get(k) for k in split},
            "measured": float(measured[own].mean()) if own.any() else 0.0,
            "model": mine.model.name, "true_model": true_kind(true),
            "roughness": found_roughness(mine), "true_roughness": true_roughness(true),
            "f0": mine.f0,
            "true_f0": true["base_color"] if true["metallic"] and "base_color" in true else None,
            "scores": mine.scores, "note": mine.note,
        })  # fmt: skip
    lamps = {lamp.object_id: lamp for lamp in shading.lamps}
    names = {one.object_id: one.name for one in recovery.capture.instances}
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


def _true(seen: list[dict], key: str) -> np.ndarray:
    """What the views hold at the pixels that count, view after view."""
    return np.concatenate([view[key][view["counts"]] for view in seen])


def _shown(seen: list[dict], values: np.ndarray) -> np.ndarray:
    """What the views show there of elements' values."""
    return np.concatenate([values[view["element"]].mean(0)[view["counts"]] for view in seen])


def _scaled(seen: list[dict], base: np.ndarray) -> dict[str, float]:
    """PSNR after one scale, and after one for each channel."""
    mine, true = _shown(seen, base).astype(np.float64), _true(seen, "truth").astype(np.float64)
    one = (mine * true).sum() / (mine * mine).sum()
    three = (mine * true).sum(0) / (mine * mine).sum(0)
    return {
        f"after one scale ({one:.3f})": psnr(seen, base * np.float32(one)),
        f"after three scales ({', '.join(f'{x:.3f}' for x in three)})": psnr(seen, base * np.float32(three)),
    }


def _ratios(seen, split, base, truth) -> tuple[dict, dict]:
    """Median of estimate / truth by object, quantity and channel; and each object's share of the squared error."""
    light, colour, ids = (_true(seen, key) for key in ("diffuse_light", "diffuse_color", "id"))
    true = {"albedo": colour, "L_d": light * colour, "median": light * colour, "E": np.pi * light}
    found = {kind: _shown(seen, values) for kind, values in split.items()}
    error = np.square(np.clip(_shown(seen, base), 0, 1) - np.clip(_true(seen, "truth"), 0, 1)).sum(1)
    share = {int(i): float(error[ids == i].sum() / error.sum()) for i in np.unique(ids)}
    ratios = {}
    for i in truth:
        own = ids == i
        if own.sum() < 20:
            continue
        ratios[i] = {}
        for kind in split:
            a, b = found[kind][own], true[kind][own]
            good = np.isfinite(a).all(1) & np.isfinite(b).all(1)
            # The truth's light is noisy: sums over blocks of pixels are compared.
            n = max(1, good.sum() // 40)
            blocks = np.array_split(np.flatnonzero(good), n)
            quotient = [a[part].sum(0) / np.maximum(b[part].sum(0), 1e-9) for part in blocks if len(part)]
            ratios[i][kind] = np.median(quotient, 0).tolist() if quotient else None
    return ratios, share
