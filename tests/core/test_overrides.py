"""What the artist gives, as a file: read, refused in one sentence, merged."""

from __future__ import annotations

import json

import pytest

from addon.core.errors import BadInputError
from addon.core.results.overrides import NONE, Given, Overrides, White, heeded, merge, parse, read_overrides

KNOWN = range(5)


def read(told):
    return parse(told, "'o.json'", KNOWN)


def test_everything_that_can_be_given(tmp_path):
    told = {
        "objects": {
            "0": {"model": "specular", "roughness": 0.3, "f0": 0.04, "base_color": [0.1, 0.2, 1]},
            "1": {"model": "metal", "f0": [1, 0.8, 0.3]},
            "2": {"same_as": 1, "base_color": [0, 0, 0]},
            "3": {"model": "emitter"},
        },
        "white": {"object": 4, "albedo": 0.8},
    }
    file = tmp_path / "given.json"
    file.write_text(json.dumps(told))
    found = read_overrides(file, KNOWN)
    assert found.of(0) == Given("specular", 0.3, 0.04, (0.1, 0.2, 1))
    assert found.of(1).f0 == (1, 0.8, 0.3) and found.of(2).same_as == 1 and found.of(3).model == "emitter"
    assert found.white == White(4, (0.8, 0.8, 0.8)) and not found.of(4).any
    spot = read({"white": {"object": 4, "albedo": 0.8, "at": [1, 2.5, 0]}})
    assert spot.white.at == (1.0, 2.5, 0.0) and read(spot.as_dict()) == spot
    assert read(found.as_dict()) == found  # what is written is what is read


def test_nothing_is_nothing():
    assert not read({}).any and not read({"objects": {}}).any and not read({"objects": {"1": {}}}).any
    assert read({"objects": {"1": {}}}).lobes_key() == NONE.lobes_key() == ()


@pytest.mark.parametrize(
    ("told", "says"),
    [
        ([], ("objects, white",)),
        ({"object": {}}, ("'object'", "objects, white")),
        ({"objects": [1]}, ("'objects'", "object_id")),
        ({"objects": {"7": {}}}, ("no object 7", "0 to 4")),
        ({"objects": {"sofa": {}}}, ("'sofa'", "whole number")),
        ({"objects": {"1": 3}}, ("object 1", "model, roughness")),
        ({"objects": {"1": {"rougness": 0.1}}}, ("object 1", "'rougness'", "roughness")),
        ({"objects": {"1": {"model": "glass"}}}, ("object 1", "'glass'", "metal")),
        ({"objects": {"1": {"model": ["metal"]}}}, ("object 1", "'model'", "metal")),
        ({"objects": {"1": {"roughness": 1.01}}}, ("object 1", "'roughness'", "0 to 1")),
        ({"objects": {"1": {"roughness": -0.1}}}, ("object 1", "'roughness'", "0 to 1")),
        ({"objects": {"1": {"roughness": float("nan")}}}, ("object 1", "nan", "0 to 1")),
        ({"objects": {"1": {"roughness": True}}}, ("object 1", "True")),
        ({"objects": {"1": {"roughness": "0.5"}}}, ("object 1", "'0.5'")),
        ({"objects": {"1": {"f0": [1, 1]}}}, ("object 1", "'f0'", "three numbers")),
        ({"objects": {"1": {"f0": [1, 1, float("inf")]}}}, ("object 1", "'f0'", "inf")),
        ({"objects": {"1": {"base_color": 0.5}}}, ("object 1", "'base_color'", "three numbers")),
        ({"objects": {"1": {"same_as": 9}}}, ("object 1", "'same_as'", "no object 9")),
        ({"objects": {"1": {"same_as": 1.0}}}, ("object 1", "'same_as'", "whole number")),
        ({"objects": {"1": {"same_as": 1}}}, ("circle", "1 -> 1")),
        ({"objects": {"1": {"same_as": 2}, "2": {"same_as": 3}, "3": {"same_as": 1}}}, ("circle", "1 -> 2 -> 3 -> 1")),
        ({"objects": {"1": {"same_as": 2, "roughness": 0.1}}}, ("object 1", "'same_as'", "roughness")),
        ({"objects": {"1": {"model": "lambertian", "roughness": 0.1}}}, ("object 1", "'lambertian'", "'roughness'")),
        ({"objects": {"1": {"model": "emitter", "base_color": [1, 1, 1]}}}, ("object 1", "'emitter'", "'base_color'")),
        ({"white": {"object": 1}}, ("'white'", "'albedo'")),
        ({"white": {"albedo": 0.8}}, ("'white'", "'object'")),
        ({"white": {"object": 8, "albedo": 0.8}}, ("'white'", "no object 8")),
        ({"white": {"object": 1, "albedo": 1.2}}, ("'white'", "0 to 1")),
        ({"white": {"object": 1, "albedo": [0.8, 0, 0.8]}}, ("'white'", "more than 0")),
        ({"white": 0.8}, ("'white'", "object, albedo")),
        ({"white": {"object": 1, "albedo": 0.8, "at": [0, 1]}}, ("'at'", "three coordinates")),
        ({"white": {"object": 1, "albedo": 0.8, "at": [0, 1, float("nan")]}}, ("'at'", "three coordinates")),
    ],
)
def test_faults_are_one_sentence_that_names_them(told, says):
    with pytest.raises(BadInputError) as error:
        read(told)
    text = str(error.value)
    assert all(part in text for part in ("'o.json'", *says)), text
    assert text.endswith(".") and "\n" not in text


def test_files_that_are_none(tmp_path):
    with pytest.raises(BadInputError, match="is no file"):
        read_overrides(tmp_path / "absent.json", KNOWN)
    broken = tmp_path / "broken.json"
    broken.write_text('{"objects": {"1": }}')
    with pytest.raises(BadInputError, match=r"broken\.json.* is not valid JSON"):
        read_overrides(broken, KNOWN)


def both(older, newer):
    return merge(read({"objects": older}), read({"objects": newer})).as_dict()["objects"]


def test_later_wins_key_by_key():
    assert both(
        {"1": {"model": "metal", "roughness": 0.2}, "2": {"roughness": 0.9}},
        {"1": {"roughness": 0.4}, "3": {"model": "emitter"}},
    ) == {"1": {"model": "metal", "roughness": 0.4}, "2": {"roughness": 0.9}, "3": {"model": "emitter"}}


@pytest.mark.parametrize(
    ("older", "newer", "left"),
    [
        (
            {"model": "metal", "roughness": 0.2, "base_color": [1, 0, 0]},
            {"same_as": 2},
            {"base_color": [1, 0, 0], "same_as": 2},
        ),
        ({"same_as": 2}, {"roughness": 0.1}, {"roughness": 0.1}),
        ({"model": "metal", "f0": 0.9}, {"model": "lambertian"}, {"model": "lambertian"}),
        ({"model": "lambertian"}, {"roughness": 0.1}, {"roughness": 0.1}),
        ({"base_color": [1, 0, 0]}, {"model": "emitter"}, {"model": "emitter"}),
        ({"model": "emitter"}, {"base_color": [1, 0, 0]}, {"base_color": [1, 0, 0]}),
    ],
)
def test_what_goes_not_together_is_replaced(older, newer, left):
    merged = merge(read({"objects": {"1": older}}), read({"objects": {"1": newer}}))
    assert merged.as_dict()["objects"] == {"1": left}
    assert read(merged.as_dict()) == merged  # and can be read again


def test_null_takes_back():
    older = {"1": {"model": "metal", "roughness": 0.2}, "2": {"roughness": 0.9}}
    assert both(older, {"1": {"roughness": None}}) == {"1": {"model": "metal"}, "2": {"roughness": 0.9}}
    assert both(older, {"2": {"roughness": None}}) == {"1": older["1"]}
    assert both(older, {"1": None}) == {"2": {"roughness": 0.9}}
    white = Overrides(white=White(1, (0.5,) * 3))
    assert merge(white, read({})).white == white.white and merge(white, read({"white": None})).white is None


def test_a_circle_made_by_both_is_told():
    with pytest.raises(BadInputError, match="circle"):
        both({"1": {"same_as": 2}}, {"2": {"same_as": 1}})


def test_the_chain_of_same_as_is_followed():
    given = read({"objects": {"1": {"same_as": 2}, "2": {"same_as": 3}}})
    assert given.chain(1) == (2, 3) and given.chain(3) == ()


def test_only_what_bears_on_highlights_makes_them_anew():
    colour = read({"objects": {"1": {"base_color": [0.5, 0.5, 0.5]}}, "white": {"object": 2, "albedo": 0.8}})
    rough, metal = read({"objects": {"1": {"roughness": 0.5}}}), {"model": "metal", "base_color": [0.9, 0.6, 0.3]}
    assert colour.lobes_key() == () != rough.lobes_key()
    assert read({"objects": {"1": metal}}).lobes()[1].f0 == (0.9, 0.6, 0.3)  # a metal's colour is its F0
    assert rough.lobes_key() != read({"objects": {"2": {"roughness": 0.5}}}).lobes_key()


def test_a_run_heeds_what_is_kept_and_over_that_the_file(tmp_path):
    assert heeded(tmp_path, KNOWN) == NONE
    (tmp_path / "overrides.json").write_text('{"objects": {"1": {"roughness": 0.5}}}')
    file = tmp_path / "more.json"
    file.write_text('{"objects": {"2": {"roughness": 0.1}}}')
    assert set(heeded(tmp_path, KNOWN).objects) == {1}
    assert set(heeded(tmp_path, KNOWN, file).objects) == {1, 2}
    assert set(heeded(tmp_path, KNOWN, file, keep=False).objects) == {2}
    with pytest.raises(BadInputError, match=r"overrides\.json.*no object 1"):  # of another capture
        heeded(tmp_path, range(1))
