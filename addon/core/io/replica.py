"""The layout of Replica (Straub et al. 2019): a mesh of quads whose light is stored on it, and no frames.

`mesh.ply`; `textures/parameters.json` with `splitSize` and `tileSize`; `textures/N-color-ptex.hdr`, raw half floats (no
Radiance format); `habitat/mesh_semantic.ply` and `habitat/info_semantic.json` for the objects; `glass.sur` for its
mirrors. Where the folder also holds frames (`transforms.json`, or `traj.txt` with `results`), those are taken, and the
stored light is not. The viewer's exposure and gamma are display and are not applied.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ..errors import BadInputError
from ..json_values import is_number
from ..kinds import Code, Limit
from ..scene.model import KnownMirror
from ..scene.stored_light import LitTiles
from . import nerfstudio, traj
from .files import read_bytes, read_json
from .formats import FORMATS
from .instances import FILE, read_instances
from .layout import Layout, RawMesh, Reader, Reading, holding
from .ply import read_ply
from .replica_glass import FILE as GLASS
from .replica_glass import mirrors_of, read_panes

MESH, TEXTURES, PARAMETERS = "mesh.ply", "textures", "textures/parameters.json"
SEMANTIC, NAMES, ORDER = "habitat/mesh_semantic.ply", "habitat/info_semantic.json", "habitat/sorted_faces.bin"
PICTURE, LOW_RANGE = "{}-color-ptex.hdr", ("{}-color-ptex.rgb", "{}-color-ptex.dxt1")
TEXEL_BYTES: Code[int] = 6
MAX_TILE: Limit[int] = 1 << 12
CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
"""Where a quad's corners lie in its tile."""
FAR = 3.0
"""Times the usual edge: a face of the mesh with the objects that is further off is another one."""


def read(root: Path, reading: Reading) -> Layout:
    """Read the mesh, its light or the frames beside it, its objects and mirrors, as `layout.Reader` has it."""
    if reading.mesh is not None:
        raise BadInputError(f"Capture '{root}' has its light on its own mesh; leave --mesh away.")
    mesh = read_ply(root / MESH)
    names, notes, names_file = None, [], NAMES
    if (root / SEMANTIC).is_file():
        ids, far = _object_id(root / SEMANTIC, mesh)
        mesh = replace(mesh, object_id=ids)
        if far:
            notes.append(f"{far:.1%} of the triangles have no face of '{SEMANTIC}' near; they belong to no object.")
    elif (root / FILE).is_file():
        names_file = FILE
    if (root / names_file).is_file():
        names = read_instances(root / names_file)
    mirrors: list[KnownMirror] = []
    if (root / GLASS).is_file():
        panes, wrong = read_panes(root / GLASS)
        mirrors, more = mirrors_of(panes, mesh, names or {})
        notes += wrong + more
    reader = next((reader for reader in (nerfstudio.READER, traj.READER) if reader.find(root)), None)
    if reader is not None:
        layout = reader.read(root, replace(reading, mesh=root / MESH))
        mesh = replace(mesh, vertices=layout.mesh.vertices)  # its reader may have moved it to the poses' world
        notes.append("The capture has frames; the light stored on its mesh is not used.")
        return Layout(layout.frames, mesh, names, names_file, layout.problems, layout.notes + notes, mirrors)
    notes.append(
        "The capture has no frames; its light is taken from the textures on its mesh, which hold one value "
        "for all views: highlights can't be told, nor what lies outside."
    )
    return Layout([], replace(mesh, lit=_tiles(root, mesh)), names, names_file, notes=notes, mirrors=mirrors)


def _tiles(root: Path, mesh: RawMesh) -> LitTiles:
    """Which tile each triangle shows."""
    split, size = _parameters(root / PARAMETERS)
    assert mesh.faces is not None and mesh.faces.corner is not None
    face, corner = mesh.faces.of_triangle, mesh.faces.corner
    faces = int(face.max(initial=-1)) + 1
    if len(mesh.triangles) != 2 * faces or corner.max(initial=0) > 3:
        raise BadInputError(
            f"Mesh '{root / MESH}' is not made of quads alone, as its textures need; use the one that came with them."
        )
    quads = np.zeros((faces, 4), np.int64)
    quads[face[:, None], corner] = mesh.triangles
    if split > 0 and not (root / ORDER).is_file():
        raise BadInputError(f"'{root / ORDER}' is needed to tell whose texture is whose, but is missing; copy it, too.")
    chunks = _sorted_faces(root / ORDER, faces) if split > 0 else [np.arange(faces)]
    paths, sides = [], []
    picture, tile = np.zeros(faces, np.int32), np.zeros(faces, np.int32)
    for i, chunk in enumerate(chunks):
        path = root / TEXTURES / PICTURE.format(i)
        paths.append(path)
        sides.append(_side(path, size, len(chunk), root, i))
        picture[chunk], tile[chunk] = i, np.arange(len(chunk))
    if (root / TEXTURES / PICTURE.format(len(chunks))).exists():
        raise BadInputError(
            f"'{root / TEXTURES}' has more pictures than the mesh's {len(chunks)} chunks; use the mesh "
            "that came with them."
        )
    return LitTiles(tuple(paths), tuple(sides), size, picture[face], tile[face], CORNERS[corner])


def _sorted_faces(path: Path, faces: int) -> list[np.ndarray]:
    """Faces of each chunk in its order, from a file: how many chunks (u64); of each, how many faces (u64), which (u32).

    Chunk N's squares are the picture `N-color-ptex.hdr`, row by row in that order, which an unstable sort happened to
    leave. Raises `BadInputError` where the file does not list each of `faces` faces once.
    Source: Habitat, `PTexMeshData.cpp`.
    """
    content = read_bytes(path, max_bytes=64 + 12 * faces)  # more than a chunk for each face takes
    words = np.frombuffer(content[: len(content) // 4 * 4], "<u4").astype(np.int64)
    chunks, at = [], 2
    while at + 2 <= len(words):
        end = at + 2 + (int(words[at]) | int(words[at + 1]) << 32)
        if end > len(words):
            break
        chunks.append(words[at + 2 : end])
        at = end
    listed = np.concatenate(chunks) if chunks else np.zeros(0, np.int64)
    whole = len(listed) == faces and listed.max(initial=0) < faces and len(np.unique(listed)) == faces
    if at != len(words) or not whole or len(chunks) != words[0] + (words[1] << 32):
        raise BadInputError(
            f"'{path}' does not list each of the mesh's {faces} faces once; take it away or copy it again."
        )
    return chunks


def _parameters(path: Path) -> tuple[float, int]:
    """Edge of the grid's cells in metres (0: a single chunk), and of a tile in texels."""
    top = read_json(path)
    split, size = top.get("splitSize"), top.get("tileSize")
    if not is_number(split) or not is_number(size) or size != int(size) or not 1 <= size <= MAX_TILE:
        raise BadInputError(f"'{path}' has splitSize {split!r} and tileSize {size!r}; copy it again.")
    return float(split), int(size)


def _side(path: Path, size: int, faces: int, root: Path, i: int) -> int:
    """Edge of a picture in texels, by the file's size."""
    if not path.is_file():
        low = next((name.format(i) for name in LOW_RANGE if (root / TEXTURES / name.format(i)).is_file()), None)
        what = f"only '{low}', which is not HDR" if low else "it is missing"
        raise BadInputError(f"Texture '{path}' is needed for the mesh's light, but {what}; copy all of '{TEXTURES}'.")
    count = path.stat().st_size
    side = round((count / TEXEL_BYTES) ** 0.5)
    if TEXEL_BYTES * side * side != count:
        raise BadInputError(
            f"Texture '{path}' has {count} bytes, which is no square of raw half floats; copy it again."
        )
    if (side // size) ** 2 < faces:
        raise BadInputError(
            f"Texture '{path}' has room for {(side // size) ** 2} faces of {size} x {size} texels, but "
            f"its chunk has {faces}; use the mesh and parameters that came with it."
        )
    return side


def _object_id(path: Path, mesh: RawMesh) -> tuple[np.ndarray, float]:
    """The object of each triangle ((t,) int64, -1: none), and the share of those without.

    The mesh with the objects lists the same faces, but not always in the same order: the nearest one counts.
    """
    annotated = read_ply(path)
    if annotated.object_id is None:
        raise BadInputError(f"Mesh '{path}' has no object_id on its faces; copy it again.")
    if not len(annotated.triangles) or not len(mesh.triangles):
        raise BadInputError(f"Mesh '{path}' or '{MESH}' has no triangles; copy them again.")
    centres, annotated_centres = (m.vertices[m.triangles].mean(1) for m in (mesh, annotated))
    if centres.shape == annotated_centres.shape and np.allclose(centres, annotated_centres, atol=1e-4):
        return annotated.object_id, 0.0
    if not (np.isfinite(centres).all() and np.isfinite(annotated_centres).all()):
        raise BadInputError(f"Mesh '{path}' or '{MESH}' has vertices that are not finite; copy them again.")
    distance, nearest = cKDTree(annotated_centres).query(centres)
    edge = float(np.median(np.linalg.norm(np.diff(mesh.vertices[mesh.triangles[:, :2]], axis=1), axis=2)))
    far = distance > FAR * edge
    return np.where(far, -1, annotated.object_id[nearest]), float(far.mean())


READER = Reader("replica", FORMATS["replica"], holding(PARAMETERS, MESH), read)
