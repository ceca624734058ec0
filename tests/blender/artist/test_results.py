"""What the panel Results tells: read from the result folder, sorted, and never saved."""

import importlib
import json
import os

import pytest

bpy = pytest.importorskip("bpy")

from tests.blender.artist.artist_room import box, mesh_object  # noqa: E402

OBJECTS = [
    {
        "object_id": 0,
        "model": "specular",
        "alpha": 0.09,
        "f0": 0.04,
        "roughness_low": 0.1,
        "roughness_high": 0.7,
        "evidence": {
            "albedo": [0.5, 0.5, 0.5],
            "albedo_low": [0.4] * 3,
            "albedo_high": [0.6] * 3,
            "seen_share": 0.5,
            "area": 2.0,
            "observations": 12,
        },
    },
    {
        "object_id": 1,
        "model": "lambertian",
        "alpha": None,
        "roughness_low": 0.0,
        "roughness_high": 1.0,
        "evidence": {"albedo": [0.5] * 3, "albedo_low": [0.45] * 3, "albedo_high": [0.55] * 3},
    },
    {
        "object_id": 2,
        "model": "metal",
        "alpha": 0.04,
        "f0": [0.9, 0.6, 0.3],
        "roughness_low": 0.1,
        "roughness_high": 0.4,
    },
    {"object_id": 3, "model": "emitter", "emission": [3.0, 2.0, 1.0]},
]
RUN, LATER = "0123456789abcdef", "fedcba9876543210"


@pytest.fixture
def results(ops):
    """The registered package's module, with nothing read yet."""
    module = importlib.import_module("scan_relight.operators.results.summary")
    module.file.forget()
    return module


def write(folder, run=RUN, objects=OBJECTS):
    folder.mkdir(exist_ok=True)
    (folder / "materials.json").write_text(json.dumps({"run": run, "objects": objects}))


def recovered(thing, number, folder, run=RUN):
    thing["object_id"], thing["scan_relight_result"], thing["scan_relight_run"] = number, str(folder), run
    return thing


@pytest.fixture
def scene(ops, results, tmp_path):
    for number, name in enumerate(("wall", "Apple", "tap", "lamp")):
        recovered(mesh_object(name, *box((number, 0, 0), (number + 0.5, 1, 1))), number, tmp_path)
    mesh_object("the user's own", *box((0, 2, 0), (1, 3, 1)))
    write(tmp_path)
    bpy.context.scene.scan_relight.result_folder = str(tmp_path)
    return bpy.context.scene


def test_doubt(results):
    found = [results.interval_width(one) for one in OBJECTS]
    assert found[:3] == pytest.approx([0.6, 0.1, 0.3]) and found[3] is None
    assert [results.certainty(one) for one in OBJECTS] == ["unsure", "sure", "fair", "unknown"]


def test_facts_name_what_is_known(results):
    facts = dict(results.facts(OBJECTS[0]))
    assert facts["Roughness"] == "0.30  (0.10 to 0.70)" and facts["Albedo"] == "0.50  (0.40 to 0.60)"
    assert facts["Seen"] == "50% of 2 m\u00b2" and facts["Certainty"] == "Unsure"
    assert dict(results.facts(OBJECTS[2]))["Specular F0"] == "0.60"
    assert dict(results.facts(OBJECTS[3])) == {"Model": "Lamp", "Radiance": "3, 2, 1", "Certainty": "Unknown"}
    given = OBJECTS[2] | {"given": {"model": "metal", "f0": [0.9, 0.6, 0.3]}}
    assert dict(results.facts(given))["Given"] == "model Metal, F0 0.90 0.60 0.30"
    assert results.facts({"model": "something new"})[0] == ("Model", "something new")


@pytest.mark.parametrize(
    "order, names",
    [
        ("NAME", ["Apple", "lamp", "tap", "wall"]),
        ("MODEL", ["lamp", "Apple", "tap", "wall"]),
        ("CERTAINTY", ["wall", "tap", "Apple", "lamp"]),
    ],
)
def test_orders(scene, results, order, names):
    key = importlib.import_module("scan_relight.operators.results.panel").order_key
    known = results.result_of(scene).objects
    things = [thing for thing in scene.objects if "object_id" in thing]
    assert [thing.name for thing in sorted(things, key=lambda t: key(t.name, known[t["object_id"]], order))] == names


def test_read_again_when_the_file_changes_and_only_then(scene, results, tmp_path, monkeypatch):
    first = results.result_of(scene)
    assert results.result_of(scene) is first
    write(tmp_path, objects=OBJECTS[:2])
    os.utime(tmp_path / "materials.json", (1, 1))
    assert len(results.result_of(scene).objects) == 2


def test_the_list_shows_roughness_and_f0(results):
    columns = importlib.import_module("scan_relight.operators.results.panel").columns
    assert [columns(one) for one in OBJECTS] == [(".30", ".04"), ("", ""), (".20", ".60"), ("", "")]


def test_a_result_of_version_0_1_shows_the_same(scene, results, tmp_path):
    now = [results.facts(one) for one in results.result_of(scene).objects.values()]
    old = {"alpha": "phi", "f0": "psi"}
    before = [
        {old.get(key, key) if not isinstance(value, list) else key: value for key, value in one.items()}
        for one in OBJECTS
    ]
    assert "phi" in before[0] and "alpha" not in before[0]
    write(tmp_path, objects=before)
    os.utime(tmp_path / "materials.json", (1, 1))
    assert [results.facts(one) for one in results.result_of(scene).objects.values()] == now


def listed(scene, results):
    """What the list shows: alpha by the object's name."""
    rows = results.file.rows_of_parts(scene.objects)
    return {thing.name: parts[thing["object_id"]].get("alpha") for thing, parts in rows.items()}


def test_two_rooms_each_show_their_own_values(scene, results, tmp_path):
    write(tmp_path / "attic", LATER, [{"object_id": 1, "model": "specular", "alpha": 0.64}])
    recovered(mesh_object("beam", *box((0, 3, 0), (1, 4, 1))), 1, tmp_path / "attic", LATER)
    assert listed(scene, results) == {"wall": 0.09, "Apple": None, "tap": 0.04, "lamp": None, "beam": 0.64}
    assert results.refused(scene.objects) == []
    bpy.context.view_layer.objects.active = scene.objects["beam"]
    assert results.folder_of(scene) == tmp_path / "attic"
    bpy.context.view_layer.objects.active = scene.objects["the user's own"]
    assert results.folder_of(scene) == tmp_path


def test_another_run_s_values_are_never_shown(scene, results, tmp_path):
    write(tmp_path, LATER)
    assert listed(scene, results) == {}
    [(sentence, folder)] = results.refused(scene.objects)
    assert folder == tmp_path and "bring in the new one" in sentence
    assert sentence.startswith("4 objects of this scene are of an earlier run")
    recovered(scene.objects["tap"], 2, tmp_path, LATER)
    assert listed(scene, results) == {"tap": 0.04}
    assert results.refused(scene.objects)[0][0].startswith("3 objects")


def test_objects_whose_run_nobody_can_tell_are_refused(scene, results, tmp_path):
    del scene.objects["wall"]["scan_relight_run"]  # of an earlier version
    for key in ("scan_relight_result", "scan_relight_run"):
        del scene.objects["tap"][key]  # imported, with nothing put on: it is not spoken of
        del scene.objects["lamp"][key]  # of an old scene.blend
    worn = bpy.data.materials.new("old")
    worn["scan_relight_model"] = "emitter"
    scene.objects["lamp"].data.materials.append(worn)
    assert listed(scene, results) == {"Apple": None}
    [(sentence, folder)] = results.refused(scene.objects)
    assert folder is None and "run again" in sentence
    assert sentence.startswith("2 objects of this scene are of an older version")
    write(tmp_path, run="")  # a folder of an earlier version
    assert listed(scene, results) == {} and results.refused(scene.objects)[0][0].startswith("3 objects")


@pytest.mark.parametrize("text", ["", "[1, 2]", '{"objects": 3}', '{"objects": [{"model": "metal"}]}'])
def test_a_damaged_file_is_an_empty_result(scene, results, tmp_path, text):
    (tmp_path / "materials.json").write_text(text)
    found = results.result_of(scene)
    assert found.objects == {}


def test_rows_follow_the_active_object_and_select(scene):
    wall, tap = scene.objects["wall"], scene.objects["tap"]
    bpy.context.view_layer.objects.active = wall
    assert scene.objects[scene.scan_relight_row] == wall
    scene.scan_relight_row = scene.objects.find("tap")
    assert bpy.context.view_layer.objects.active == tap and bpy.context.selected_objects == [tap]
    assert "scan_relight_row" not in scene.keys()


def test_selecting_by_number(scene, ops):
    assert ops.select_result_object(object_id=1) == {"FINISHED"}
    assert [thing.name for thing in bpy.context.selected_objects] == ["Apple"]
    assert ops.select_result_object(object_id=3, extend=True) == {"FINISHED"}
    assert len(bpy.context.selected_objects) == 2
    with pytest.raises(RuntimeError, match="Object 9 is not in this scene"):
        ops.select_result_object(object_id=9)
    scene.objects["tap"].hide_set(True)
    with pytest.raises(RuntimeError, match="'tap' is hidden; show it first"):
        ops.select_result_object(object_id=2)


def test_the_report(scene, ops, tmp_path):
    with pytest.raises(RuntimeError, match="There is no report yet"):
        ops.open_report()
    (tmp_path / "report.html").write_text("<p>")
    assert ops.open_report() == {"FINISHED"}


@pytest.mark.parametrize(
    "name", ["capture_from_scene", "restore_materials", "select_result_object", "look", "open_report", "write"]
)
def test_every_property_has_its_text(ops, name):
    kind = getattr(ops, name).get_rna_type()
    assert kind.description
    assert all(one.description for one in kind.properties if one.identifier != "rna_type" and not one.is_hidden)


def test_the_button_brings_in_what_lies_in_the_objects_own_folder(scene, ops, tmp_path):
    """The panel may be about another capture."""
    from types import SimpleNamespace

    from tests.blender.panel.conftest import Layout

    class Shown(Layout):
        def __init__(self, *args):
            super().__init__(*args)
            self.made = []

        def operator(self, name, **more):
            properties = super().operator(name, **more)
            self.made.append((name, properties))
            return properties

        def template_list(self, *_, **__):
            """Nothing to remember."""

    panels = importlib.import_module("scan_relight.operators.results.panel")

    def drawn():
        layout, cls = Shown(), panels.SCAN_RELIGHT_PT_results
        panel = SimpleNamespace(layout=layout, say=cls.say)
        panel.bring_in = cls.bring_in.__get__(panel)
        cls.draw(panel, SimpleNamespace(scene=scene, preferences=bpy.context.preferences, region=None))
        return layout.text, layout.made[0]

    write(tmp_path, LATER)
    text, (button, properties) = drawn()
    assert "4 objects of this scene are of an earlier run" in text
    assert (button, properties.folder) == ("scan_relight.open_result", str(tmp_path))
    scene.scan_relight.capture_folder = str(tmp_path / "capture")
    _, (button, properties) = drawn()
    assert (button, properties.target) == ("scan_relight.run", "write")
