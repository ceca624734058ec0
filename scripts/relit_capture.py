"""A capture of a real-looking room in other light, and of other materials: a recovered scene is the truth.

    python -m scripts.relit_capture CAPTURE SCENE.blend OUT [--off ID,...] [--scale ID=K ...] [--sky K]
        [--sun X,Y,Z,STRENGTH] [--materials SEED] [--every 2] [--samples 32] [--views 6]

CAPTURE is one with truth/ (its mesh, poses and held-out views are taken over) and SCENE.blend what
`scan-relight recover CAPTURE --without material-parts` wrote of it. The lights are changed, with --materials each class
of objects gets another tint, roughness and lobe, and Cycles renders frames and truth. What is found of OUT is scored
like any capture. Generated rooms have boxes for furniture; these have what artists modelled.
"""

import argparse
import importlib.util
import json
import shutil
from pathlib import Path

import bpy
import numpy as np

from addon.bridge.data.materials import BASE_COLOR, EMISSION_STRENGTH, IOR, METALLIC, ROUGHNESS, SPECULAR_LEVEL
from addon.bridge.data.nodes import add_node, feed, find_node
from addon.core.io.exr import write_exr

from .qa_rooms.render import STRENGTHS, add_sun, relight

MIRROR = 0.05
"""Metals with less roughness stay as they are: a mirror is no paint."""

DIFFUSE = 0.4
"""Share of the classes of what isn't metal that get no lobe."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path)
    parser.add_argument("scene", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--off", default="", help="objects whose light goes out: ID,ID,...")
    parser.add_argument("--scale", action="append", default=[], help="ID=K: an object's light K times as strong")
    parser.add_argument("--sky", type=float, default=1.0, help="how many times as bright as it is")
    parser.add_argument("--sun", default="", help="X,Y,Z,STRENGTH: where it is, and its irradiance in W/m^2")
    parser.add_argument("--materials", type=int, metavar="SEED", help="classes get other tints, roughnesses and lobes")
    parser.add_argument("--every", type=int, default=2, help="each how manyth of the frames")
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--views", type=int, default=6)
    options = parser.parse_args()
    scorer = load_scorer(options.capture)
    bpy.ops.wm.open_mainfile(filepath=str(options.scene.resolve()))
    scene = bpy.context.scene
    instances = json.loads((options.capture / "info_semantic.json").read_text())["objects"]
    classes = {item["id"]: item["class_name"] for item in instances}
    if options.materials is not None:
        change_materials(classes, np.random.default_rng(options.materials))
    change_lights(scene, options)
    options.out.mkdir(parents=True)
    for name in ("mesh.ply", "info_semantic.json"):
        shutil.copy(options.capture / name, options.out / name)
    render(scorer, scene, options, truth_of(classes))


def load_scorer(capture: Path):
    """The module that scores captures like this one: it renders what its figures compare."""
    path = capture.resolve().parents[1] / "score" / "score_scene.py"
    spec = importlib.util.spec_from_file_location("score_scene", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def recovered_objects() -> dict[int, bpy.types.Object]:
    """Mesh objects by their number in the capture."""
    objects = {o.get("object_id"): o for o in bpy.data.objects if o.type == "MESH" and o.data.materials}
    return {int(number): o for number, o in objects.items() if number is not None}


def change_materials(classes: dict[int, str], rng: np.random.Generator) -> None:
    """Give each class of objects another tint, roughness and lobe; lamps, mirrors and what is cut out stay."""
    names = sorted(set(classes.values()))
    drawn = {name: (rng.uniform(), rng.uniform(0.12, 0.75), rng.uniform(0.35, 1, 3)) for name in names}
    for number, obj in recovered_objects().items():
        material = obj.data.materials[0]
        shader = find_node(material, "BSDF_PRINCIPLED")
        inputs = shader and shader.inputs
        if not inputs or inputs[EMISSION_STRENGTH].default_value > 0 or find_node(material, "BSDF_TRANSPARENT"):
            continue
        if inputs[METALLIC].default_value > 0.5 and inputs[ROUGHNESS].default_value < MIRROR:
            continue
        kind, roughness, tint = drawn[classes[number]]
        socket = inputs[BASE_COLOR]
        colour = socket.links[0].from_socket if socket.links else socket.default_value[:3]
        product = add_node(material.node_tree, "ShaderNodeVectorMath", colour, tint, operation="MULTIPLY")
        feed(socket, product.outputs[0])
        inputs[ROUGHNESS].default_value = roughness
        if inputs[METALLIC].default_value < 0.5:
            inputs[IOR].default_value = 1.5
            inputs[SPECULAR_LEVEL].default_value = 0.5 if kind > DIFFUSE else 0.0


def change_lights(scene: bpy.types.Scene, options: argparse.Namespace) -> None:
    """Lamps off or of another strength, another sky, a sun."""
    scales = {int(number): float(k) for number, k in (item.split("=") for item in options.scale)}
    scales |= {int(number): 0.0 for number in options.off.split(",") if number}
    objects = recovered_objects()
    for number, scale in scales.items():
        for node in objects[number].data.materials[0].node_tree.nodes:
            if node.type in STRENGTHS:
                node.inputs[STRENGTHS[node.type]].default_value *= scale
    sky = find_node(scene.world, "BACKGROUND")
    if sky:
        sky.inputs["Strength"].default_value *= options.sky
    if options.sun:
        *place, power = map(float, options.sun.split(","))
        add_sun(scene, -np.array(place), (1, 1, 1), power, np.radians(0.53))


def render(scorer, scene: bpy.types.Scene, options: argparse.Namespace, truths: list[dict]) -> None:
    """Frames, what is true of each object, held-out pictures, albedo and the room in its one new light."""
    source, truth = options.capture / "truth", options.out / "truth"
    lens = json.loads((options.capture / "transforms.json").read_text())
    lens["frames"] = lens["frames"][:: options.every]
    held_out = json.loads((source / "transforms.json").read_text())
    held_out["frames"] = held_out["frames"][: options.views]
    camera, temporary = scorer.camera(scene, lens), str(options.out.resolve() / "temporary.exr")
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 16

    def shoot(entry: dict, samples: int, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_exr(path, scorer.shoot(scene, camera, entry["transform_matrix"], samples, True, temporary))

    (options.out / "transforms.json").write_text(json.dumps(lens, indent=1))
    (truth / "albedo").mkdir(parents=True)
    for entry in lens["frames"]:
        shoot(entry, options.samples, options.out / entry["file_path"])
    names = [Path(entry["file_path"]).name for entry in held_out["frames"]]
    for entry, name in zip(held_out["frames"], names):
        shoot(entry, 4 * options.samples, truth / "image" / name)
        for kind in ("object_id", "depth"):
            (truth / kind).mkdir(exist_ok=True)
            shutil.copy(source / kind / name, truth / kind / name)
    (truth / "transforms.json").write_text(json.dumps(held_out, indent=1))
    (truth / "materials.json").write_text(json.dumps(truths, indent=1))
    shutil.copy(source / "relight.json", truth / "relight.json")
    for name, light in json.loads((source / "relight.json").read_text()).items():
        lamp = relight(scene, light["rectangle_to_world_z_up"], light["radiance"])
        for entry, view in zip(held_out["frames"], names):
            shoot(entry, 4 * options.samples, truth / f"relight_{name}" / view)
        bpy.data.objects.remove(lamp)
    scorer.overriding(BASE_COLOR)
    for entry, name in zip(held_out["frames"], names):
        write_exr(truth / "albedo" / name, scorer.shoot(scene, camera, entry["transform_matrix"], 64, False, temporary))
    Path(temporary).unlink()


def truth_of(classes: dict[int, str]) -> list[dict]:
    """The true values of each object, as in truth/materials.json."""
    rows = []
    objects = recovered_objects()
    for number, name in classes.items():
        row = {
            "id": number, "class_name": name, "emission": None, "bsdf": "diffuse", "alpha": None, "f0": 0.0,
            "metallic": 0.0, "masked": False, "base_factor": 1.0,
        }  # fmt: skip
        rows.append(row)
        if number not in objects:
            continue
        material = objects[number].data.materials[0]
        nodes = {node.type: node for node in material.node_tree.nodes}
        if any(nodes[kind].inputs[name].default_value > 0 for kind, name in STRENGTHS.items() if kind in nodes):
            row["emission"] = [1.0, 1.0, 1.0]
        if "BSDF_PRINCIPLED" not in nodes:
            continue
        shader = nodes["BSDF_PRINCIPLED"].inputs
        row["masked"] = "BSDF_TRANSPARENT" in nodes
        ior, alpha = shader[IOR].default_value, shader[ROUGHNESS].default_value ** 2
        f0 = ((ior - 1) / (ior + 1)) ** 2 * 2 * shader[SPECULAR_LEVEL].default_value
        if shader[METALLIC].default_value > 0.5:
            row |= {"bsdf": "roughconductor", "metallic": 1.0, "alpha": alpha, "f0": None}
        elif f0 > 0.01:
            row |= {"bsdf": "roughplastic", "alpha": alpha, "f0": f0}
    return rows


if __name__ == "__main__":
    main()
