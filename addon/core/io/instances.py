"""Which object each triangle belongs to: names from `info_semantic.json`, and what to do where they don't agree."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import BadInputError
from ..kinds import Limit
from ..naming import writable
from ..scene.model import Instance
from .files import read_json

FILE = "info_semantic.json"
MAX_ID: Limit[int] = 2**31 - 2


def read_instances(path: Path) -> dict[int, str]:
    """Class name of each object that the file `path` lists.

    Takes `objects[]{id, class_name}`, and Replica's `objects[]{id, class_id}` with `classes[]{id, name}`. An object
    without either is called 'object_<id>'.

    Raises
    ------
    BadInputError
        The file is not JSON, or has no list of objects with ids.
    """
    value = read_json(path)
    objects, classes = value.get("objects"), value.get("classes", [])
    if not isinstance(objects, list):
        raise BadInputError(f"'{path}' has no list 'objects'; export it again or take it away.")
    known = [entry for entry in classes if isinstance(entry, dict)] if isinstance(classes, list) else []
    class_names = {entry["id"]: entry.get("name") for entry in known if isinstance(entry.get("id"), int)}
    names: dict[int, str] = {}
    for i, item in enumerate(objects):
        number = item.get("id") if isinstance(item, dict) else None
        if not isinstance(number, int) or isinstance(number, bool):
            raise BadInputError(f"'{path}' has an object (number {i}) without a whole 'id'; export it again.")
        class_id = item.get("class_id")
        name = item.get("class_name") or (class_names.get(class_id) if isinstance(class_id, int) else None)
        if number in names:
            raise BadInputError(f"'{path}' lists the object {number} twice; give each object an id of its own.")
        if 0 <= number <= MAX_ID:
            names[number] = str(name) if name else f"object_{number}"
    return names


def assign(
    object_id: np.ndarray, names: dict[int, str] | None, names_file: str = FILE
) -> tuple[np.ndarray, tuple[Instance, ...], list[str]]:
    """Give every triangle an instance.

    Parameters
    ----------
    object_id : (t,) int
        As the mesh has it, or as it was found.
    names : dict of int to str, or None
        As `read_instances` gives it, from `names_file`; None where the capture has none.

    Returns
    -------
    object_id : (t,) int32
        Each value has an instance.
    instances : tuple of Instance
        Sorted; each has a triangle.
    warnings : list of str
    """
    warnings = []
    present = np.unique(object_id)
    if names is None:
        warnings.append(f"The capture has no {names_file}; objects are named by their number.")
        names = {int(i): f"object_{i}" for i in present if 0 <= i <= MAX_ID}
    names = {i: writable(name) for i, name in names.items()}
    known = np.isin(present, np.fromiter(names, np.int64, len(names)))
    known_ids = present[known]
    instances = [Instance(int(i), names[int(i)]) for i in known_ids]
    idle = sorted(set(names) - {int(i) for i in known_ids})
    if idle:
        warnings.append(
            f"{len(idle)} of the objects in {names_file} have no triangles and are left out: "
            f"{_few([f'{i} ({names[i]})' for i in idle])}."
        )
    loose = ~np.isin(object_id, known_ids)
    result = object_id.copy()
    if loose.any():
        number = int(max([*known_ids.tolist(), *(i for i in names), -1])) + 1
        if number > MAX_ID:
            number = next(i for i in range(MAX_ID) if i not in names)
        result[loose] = number
        instances = sorted([*instances, Instance(number, "unlabelled")], key=lambda instance: instance.object_id)
        warnings.append(
            f"{int(loose.sum())} of {len(object_id)} triangles belong to no object; they become one of "
            f"their own, 'unlabelled' (object_id {number})."
        )
    return result.astype(np.int32), tuple(instances), warnings


def with_parts(instances: tuple[Instance, ...], path: Path) -> tuple[tuple[Instance, ...], list[str]]:
    """The instances, each `part_of` the one that its entry in the file `path` names, and warnings.

    A part has to name an instance that is no part itself; else it stays an object of its own.
    """
    entries = {item["id"]: item["part_of"] for item in read_json(path)["objects"] if item.get("part_of") is not None}
    wholes = {instance.object_id for instance in instances} - set(entries)
    parts = {i: whole for i, whole in entries.items() if type(whole) is int and whole in wholes}
    wrong = [f"{i.object_id} ({i.class_name})" for i in instances if i.object_id in entries.keys() - parts.keys()]
    warnings = [
        f"{len(wrong)} of the objects in {path.name} are 'part_of' what is no whole object of the capture, and stay "
        f"objects of their own: {_few(wrong)}."
    ]
    linked = tuple(replace(instance, part_of=parts.get(instance.object_id)) for instance in instances)
    return linked, warnings if wrong else []


def _few(items: list[str]) -> str:
    return ", ".join(items[:3]) + (f" and {len(items) - 3} more" if len(items) > 3 else "")
