"""FIPT, Replica's SLAM sequences and ScanNet++: the same capture comes out; what is wrong with one is a sentence."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exr import write_exr
from addon.core.io.formats import FORMATS
from addon.core.io.layout import RawMesh, Reading
from addon.core.io.png import write_png
from addon.core.io.read import read_capture
from addon.core.io.readers import READERS
from tests.core.io.layouts_on_disk import as_fipt, as_fipt_real, as_scannetpp, as_traj

NAMES = {i: f"side {i}" for i in range(6)}


def read_obj(path):
    """What Blender's importer would give, for the files that these tests write."""
    vertices, triangles, ids, names = [], [], [], {}
    for line in path.read_text().splitlines():
        kind, *rest = line.split(maxsplit=1)
        if kind == "v":
            vertices.append([float(x) for x in rest[0].split()])
        elif kind == "o":
            names[len(names)] = rest[0]
        else:
            triangles.append([int(i) - 1 for i in rest[0].split()])
            ids.append(len(names) - 1)
    ids = np.array(ids) if names else None
    return RawMesh(np.array(vertices), np.array(triangles, np.int32), ids, names=names or None, name=path.name)


READING = Reading(import_mesh=read_obj)
WRITERS = {
    "fipt": lambda capture, root: as_fipt(capture, root, names=NAMES),
    "fipt-real": lambda capture, root: as_fipt_real(capture, root, names=NAMES),
    "traj": as_traj,
    "scannet++": lambda capture, root: as_scannetpp(capture, root, NAMES),
}


@pytest.fixture
def source(capture):
    """The good capture; square pixels and a middle that FIPT's synthetic layout can tell."""
    capture.top(fl_y=6.0)
    return read_capture(capture.root)


@pytest.fixture(params=WRITERS)
def written(request, source, tmp_path):
    root = tmp_path / "other"
    root.mkdir()
    WRITERS[request.param](source, root)
    return request.param, root


def test_the_same_capture_comes_out(source, written):
    name, root = written
    got = read_capture(root, READING)
    assert got.format == name and len(got.frames) == len(source.frames)
    for one, other in zip(got.frames, source.frames):
        np.testing.assert_allclose(one.camera.camera_to_world, other.camera.camera_to_world, atol=1e-9)
        for what in ("width", "height", "fx", "fy", "cx", "cy"):
            assert getattr(one.camera, what) == pytest.approx(getattr(other.camera, what), rel=1e-12)
        assert one.path.read_bytes() == other.path.read_bytes()
    corners = [mesh.vertices[mesh.triangles] for mesh in (got.mesh, source.mesh)]
    np.testing.assert_array_equal(*corners)
    np.testing.assert_array_equal(got.mesh.object_id, source.mesh.object_id)
    if name != "traj":  # it has no list of objects
        assert got.instances == source.instances
        assert not got.warnings or name == "scannet++"


def test_a_named_format_is_taken(written):
    name, root = written
    assert read_capture(root, replace(READING, format=name)).format == name


@pytest.mark.parametrize("content", [b"", b"\xff\xfe\x00", b"3\n1 2 3\n"])
@pytest.mark.parametrize("path", ["train/transforms.json", "cam.txt", "K_list.txt", "traj.txt", "cam_params.json",
                                  "scans/segments.json", "scans/segments_anno.json", "dslr/train_test_lists.json",
                                  "dslr/colmap/cameras.txt", "dslr/colmap/images.txt"])  # fmt: skip
def test_a_damaged_file_is_one_sentence(source, tmp_path, path, content):
    for i, write in enumerate(WRITERS.values()):
        root = tmp_path / f"{i}"
        root.mkdir()
        write(source, root)
        if (root / path).is_file():
            (root / path).write_bytes(content)
            with pytest.raises(BadInputError) as told:
                read_capture(root, READING)
            assert "\n" not in str(told.value) and len(str(told.value).replace(str(tmp_path), "")) < 700
            return
    pytest.fail(f"nothing has a {path}")


@pytest.mark.parametrize("entry", [None, 7, {}, {"transform_matrix": "x"}, {"transform_matrix": [[1e308] * 4] * 4}])
def test_one_bad_frame_is_left_out(source, tmp_path, entry):
    as_fipt(source, tmp_path / "other", names=NAMES)
    path = tmp_path / "other/train/transforms.json"
    top = json.loads(path.read_text())
    top["frames"][3] = entry
    path.write_text(json.dumps(top))
    got = read_capture(tmp_path / "other", READING)
    assert len(got.frames) == 9 and "Frame '003'" in got.warnings[-1]
    assert [frame.path.name for frame in got.frames[2:4]] == ["002_0001.exr", "004_0001.exr"]


@pytest.mark.parametrize("angle", [0, -1, 4, "x", None])
def test_an_angle_that_is_none(source, tmp_path, angle):
    as_fipt(source, tmp_path / "other", names=NAMES)
    path = tmp_path / "other/train/transforms.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"camera_angle_x": angle}))
    with pytest.raises(BadInputError, match="camera_angle_x"):
        read_capture(tmp_path / "other", READING)


def test_fipt_without_blender_is_one_sentence(source, tmp_path):
    as_fipt(source, tmp_path / "other")
    with pytest.raises(BadInputError, match="needs Blender"):
        read_capture(tmp_path / "other")


def test_fipts_segmentation_tells_the_objects(source, tmp_path):
    root = tmp_path / "other"
    as_fipt(source, root)
    (root / "train/segmentation").mkdir()
    for i in range(10):  # the frames look at the floor
        write_exr(root / f"train/segmentation/{i:03d}.exr", np.full((6, 8, 3), 20, np.float32))
    (root / "train/segmentation/004.exr").write_bytes(b"cut off")
    got = read_capture(root, READING)
    assert [one.object_id for one in got.instances] == [20]
    assert any("voted from 9 pictures" in warning for warning in got.warnings)
    assert any("1 pictures of ids can't be used" in warning for warning in got.warnings)


def test_the_truth_of_fipt_is_never_read(source, tmp_path):
    root = tmp_path / "other"
    as_fipt(source, root, names=NAMES)
    for name in ("DiffCol", "Roughness", "Emit", "IndexMA", "albedo"):
        (root / "train" / name).mkdir()
        (root / "train" / name / "000_0001.exr").write_bytes(b"no picture")
    (root / "val").mkdir()
    (root / "val/transforms.json").write_text("no poses")
    assert not read_capture(root, READING).warnings


def test_a_real_camera_that_looks_along_its_up_is_left_out(source, tmp_path):
    root = tmp_path / "other"
    as_fipt_real(source, root, names=NAMES)
    lines = (root / "cam.txt").read_text().splitlines()
    lines[2] = lines[1]  # it looks at where it stands
    (root / "cam.txt").write_text("\n".join(lines))
    got = read_capture(root, READING)
    assert len(got.frames) == 9 and "looks along its own up" in got.warnings[0]


def test_tables_of_different_length(source, tmp_path):
    root = tmp_path / "other"
    as_fipt_real(source, root, names=NAMES)
    lines = (root / "K_list.txt").read_text().splitlines()
    (root / "K_list.txt").write_text("\n".join(["9", *lines[1:-3]]))
    with pytest.raises(BadInputError, match="10 cameras.*9"):
        read_capture(root, READING)


def test_a_sequence_as_it_is_given_out(source, tmp_path):
    root = tmp_path / "room0"
    root.mkdir()
    as_traj(source, root, beside=True)
    got = read_capture(root)
    assert got.format == "traj" and len(got.frames) == 10 and len(got.instances) == 6


def test_pictures_and_lines_that_do_not_match(source, tmp_path):
    root = tmp_path / "other"
    root.mkdir()
    as_traj(source, root)
    (root / "results/frame000004.exr").unlink()
    (root / "results/depth000004.png").write_bytes(b"no picture")
    text = (root / "traj.txt").read_text().splitlines()
    (root / "traj.txt").write_text("\n".join(text[:9]))
    got = read_capture(root)
    assert [frame.name for frame in got.frames] == [f"frame{i:06d}" for i in (0, 1, 2, 3, 5, 6, 7, 8)]
    assert any("has no line" in warning for warning in got.warnings)
    assert any("1 of 9 lines" in warning for warning in got.warnings)


@pytest.mark.parametrize("change", [{"w": 0}, {"fx": "x"}, {"h": 6.5}, {"cx": None}])
def test_a_camera_that_is_none(source, tmp_path, change):
    root = tmp_path / "other"
    root.mkdir()
    as_traj(source, root)
    top = json.loads((root / "cam_params.json").read_text())
    top["camera"].update(change)
    (root / "cam_params.json").write_text(json.dumps(top))
    with pytest.raises(BadInputError, match="cam_params.json"):
        read_capture(root)


def test_scannetpp_keeps_tests_and_blurred_pictures_out_and_finds_masks(source, tmp_path):
    root = tmp_path / "other"
    as_scannetpp(source, root, NAMES)
    (root / "dslr/train_test_lists.json").write_text(json.dumps({"train": [], "test": ["DSC00001.JPG"]}))
    (root / "dslr/nerfstudio").mkdir()
    blurred = {"frames": [{"file_path": f"DSC0000{i}.JPG", "is_bad": i == 2} for i in (2, 3)]}
    (root / "dslr/nerfstudio/transforms.json").write_text(json.dumps(blurred))
    (root / "dslr/resized_anon_masks").mkdir()
    write_png(root / "dslr/resized_anon_masks/DSC00003.png", np.full((6, 8, 3), 255, np.uint8))
    got = read_capture(root)
    assert [frame.path.stem for frame in got.frames] == [f"DSC{i:05d}" for i in (0, 3, 4, 5, 6, 7, 8, 9)]
    assert [frame.mask_path is not None for frame in got.frames] == [False, True] + 6 * [False]
    assert sum("kept out" in warning or "blurred" in warning for warning in got.warnings) == 2


def test_scannetpp_undistorted(source, tmp_path):
    root = tmp_path / "other"
    as_scannetpp(source, root, NAMES)
    (root / "dslr/resized_images").rename(root / "dslr/resized_undistorted_images")
    with pytest.raises(BadInputError, match="transforms_undistorted"):
        read_capture(root)
    (root / "dslr/nerfstudio").mkdir()
    pinhole = {"w": 8, "h": 6, "fl_x": 5.0, "fl_y": 5.5, "cx": 4.1, "cy": 3.1}
    (root / "dslr/nerfstudio/transforms_undistorted.json").write_text(json.dumps(pinhole))
    got = read_capture(root)
    assert {(f.camera.fx, f.camera.cy, f.camera.lens) for f in got.frames} == {(5.0, 3.1, None)}


@pytest.mark.parametrize(
    "groups, told",
    [
        (None, "segGroups"),
        ([7], "number 0"),
        ([{"objectId": 0.5, "segments": []}], "number 0"),
        ([{"objectId": 1, "segments": ["x"]}], "number 0"),
        ([{"objectId": 1, "segments": []}, {"id": 1, "segments": []}], "twice"),
    ],
)
def test_scannetpp_with_a_damaged_list_of_objects(source, tmp_path, groups, told):
    root = tmp_path / "other"
    as_scannetpp(source, root, NAMES)
    (root / "scans/segments_anno.json").write_text(json.dumps({"segGroups": groups}))
    with pytest.raises(BadInputError, match=told):
        read_capture(root)


def test_scannetpp_a_small_object_on_a_large_one(source, tmp_path):
    root = tmp_path / "other"
    as_scannetpp(source, root, NAMES)
    groups = json.loads((root / "scans/segments_anno.json").read_text())["segGroups"]
    whole = {"objectId": 40, "label": "room", "segments": list(range(12))}
    (root / "scans/segments_anno.json").write_text(json.dumps({"segGroups": [groups[2], whole]}))
    got = read_capture(root)
    assert [one.class_name for one in got.instances] == ["side 2", "room"]
    assert (got.mesh.object_id == 2).sum() == 2


def test_the_light_list_of_formats_is_the_readers():
    assert [(reader.name, reader.wants) for reader in READERS] == list(FORMATS.items())
