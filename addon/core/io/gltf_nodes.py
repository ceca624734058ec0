"""Where the nodes of a glTF file place its meshes.

Of thousands of nodes with one mesh, Blender's importer makes as many objects, which takes their number squared. So each
mesh is imported once, and its instances are made of where its nodes lie.
glTF 2.0, sections 3.5.2 (hierarchy) and 3.5.3 (transformations).
"""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import BadInputError

TO_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""From +Y up, as glTF and ARKit have it, to +Z up."""


class Placed(NamedTuple):
    """A mesh as a node has it.

    Attributes
    ----------
    mesh : int
        Its number.
    name : str
        The node's, '' for none.
    matrix : (4, 4) float64
        To the world, +Z up.
    first : int
        How many faces the file has before it.
    """

    mesh: int
    name: str
    matrix: np.ndarray
    first: int = 0


def placed_meshes(nodes: list[dict[str, Any]], meshes: int, path: Path) -> list[Placed]:
    """Each mesh of each node, in the order of the file's `nodes`; `meshes` is how many there are.

    Raises `BadInputError` where a node names what is not there, has two parents or is its own, or has a transformation
    that is none; `path` is the file.
    """
    damaged = BadInputError(f"Mesh '{path}' has nodes that contradict each other; export it again.")
    parent = np.full(len(nodes), -1)
    for i, node in enumerate(nodes):
        children = node.get("children", [])
        if not isinstance(children, list):
            raise damaged
        for child in children:
            if not is_index(child, len(nodes)) or parent[child] >= 0:
                raise damaged
            parent[child] = i
    world: dict[int, np.ndarray] = {}
    open_ = [i for i in range(len(nodes)) if parent[i] < 0]
    while open_:
        i = open_.pop()
        local = _matrix(nodes[i], path)
        world[i] = local if parent[i] < 0 else world[int(parent[i])] @ local
        open_ += nodes[i].get("children", [])
    if len(world) < len(nodes):  # a circle
        raise damaged
    placed = []
    for i, node in enumerate(nodes):
        if "mesh" in node:
            if not is_index(node["mesh"], meshes):
                raise damaged
            name = node.get("name")
            placed.append(Placed(node["mesh"], name if isinstance(name, str) else "", TO_Z_UP @ world[i] @ TO_Z_UP.T))
    return placed


def is_index(value: Any, count: int) -> bool:
    """Whether a value of a file is a place in a list of so many."""
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < count


def _matrix(node: dict[str, Any], path: Path) -> np.ndarray:
    """From a node to its parent, (4, 4)."""
    if "matrix" in node:
        return _numbers(node["matrix"], 16, path).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = _numbers(node.get("rotation", [0, 0, 0, 1]), 4, path)
    length = x * x + y * y + z * z + w * w
    if length > 0:
        s = 2 / length
        matrix[:3, :3] = [
            [1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
            [s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)],
            [s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)],
        ]
    matrix[:3, :3] *= _numbers(node.get("scale", [1, 1, 1]), 3, path)
    matrix[:3, 3] = _numbers(node.get("translation", [0, 0, 0]), 3, path)
    return matrix


def _numbers(value: Any, count: int, path: Path) -> np.ndarray:
    try:
        numbers = np.array(value, np.float64)
    except (TypeError, ValueError, OverflowError):
        numbers = np.zeros(0)
    if numbers.shape != (count,) or not (np.abs(numbers) < 1e30).all():
        raise BadInputError(f"Mesh '{path}' has a node whose place is not finite numbers; export it again.")
    return numbers
