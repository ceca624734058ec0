"""Take a scanned mesh's noise out of its vertices, and leave its edges sharp.

What is looked for are the points x that the scan x0 most likely came from:

    minimise  sum over points |x - x0|^2 / noise^2  +  sum over edges log(1 + (theta / scale)^2)

theta is the dihedral angle at an edge, 0 where its two triangles lie in one plane. The first term is the noise's own
(each point moves along its normal only); the second says that most edges of a room are flat and some are sharp (He and
Schaefer 2013 ask for the same with an L0 norm), and as a Lorentzian it stops pulling at the sharp ones (Black and
Rangarajan 1996). Angles know no size, so nothing shrinks: a sphere keeps its radius. Border edges have one triangle
and no angle. What a mesh of large triangles measured well already is left alone by itself: flattening it would move
its points by many times the noise.

It is solved by Gauss-Newton steps with weights from the last one's angles, while `scale` goes down (graduated
non-convexity, Blake and Zisserman 1987): first all is smoothed alike, then what stays sharp is let go.
Last, what lies in flat parts is put into their planes (`planes`), which angles alone can't tell.
"""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import cg

from ...scene.mesh_noise import noise_of
from ...scene.model import Mesh
from ...scene.weld import one_place, point_normals, ring_of, welded
from ...significance import LEVELS
from .params import DENOISE
from .planes import onto_sheets, paired

SCALES = np.geomspace(0.5, 0.02, 8)
"""Radians, one for each step."""


def hinges_of(faces: np.ndarray) -> np.ndarray:
    """The points a, b, c, d of the edges a-b at which just two triangles meet, a-b-c and a-b-d however wound, (4, e).

    Borders and edges where three or more meet are left out.
    """
    corners = np.concatenate([faces, faces[:, [1, 2, 0]], faces[:, [2, 0, 1]]])
    first, second = paired(corners[:, :2])
    c, d = corners[first, 2], corners[second, 2]
    hinges = np.stack([*np.sort(corners[first, :2], 1).T, c, d])
    return hinges[:, c != d]  # not a triangle listed twice


def dihedral(
    points: np.ndarray, hinges: np.ndarray, floor: float = 0.0
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """The angle at each hinge (`hinges_of`), and how it changes with the points.

    Parameters
    ----------
    floor : float
        Metres; lower triangles are taken for so high in the gradient.

    Returns
    -------
    theta : (e,) float
        Radians, 0 where flat, signed by the direction in which it bends.
    gradient : four (e, 3) arrays
        Of theta by the points a, b, c and d, radians per metre (Bridson et al. 2003).
    """
    a, b, c, d = hinges
    start = points[a]
    edge = points[b] - start
    squared = np.maximum((edge**2).sum(1), 1e-18)
    along = edge / np.sqrt(squared)[:, None]

    def side(opposite: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where a triangle's height meets the edge (share of its length), the unit vector along it, and the height."""
        arm = points[opposite] - start
        foot = (arm * edge).sum(1) / squared
        arm -= foot[:, None] * edge
        height = np.linalg.norm(arm, axis=1)
        return foot[:, None], arm / np.maximum(height, 1e-12)[:, None], np.maximum(height, max(floor, 1e-12))[:, None]

    foot_c, arm_c, height_c = side(c)
    foot_d, arm_d, height_d = side(d)
    # Turned alike by the edge, not by the windings.
    normal_c, normal_d = np.cross(along, arm_c), np.cross(arm_d, along)
    theta = np.arctan2((np.cross(normal_c, normal_d) * along).sum(1), (normal_c * normal_d).sum(1))
    grad_c, grad_d = -normal_c / height_c, -normal_d / height_d
    grad_a = -(1 - foot_c) * grad_c - (1 - foot_d) * grad_d
    grad_b = -foot_c * grad_c - foot_d * grad_d
    return theta, (grad_a, grad_b, grad_c, grad_d)


def _normal_equations(
    points: np.ndarray, normal: np.ndarray, hinges: np.ndarray, noise: float, scale: float
) -> tuple[np.ndarray, np.ndarray, sparse.csr_matrix, sparse.csr_matrix]:
    """Angles, their weights, their Jacobian by each point's step along its normal, and the normal equations' matrix."""
    count = len(points)
    theta, gradient = dihedral(points, hinges, noise)
    weight = 1 / (scale**2 + theta**2)
    values = np.concatenate([(derivative * normal[point]).sum(1) for derivative, point in zip(gradient, hinges)])
    rows = np.tile(np.arange(len(theta)), 4)
    jacobian = sparse.csr_matrix((values, (rows, hinges.ravel())), (len(theta), count))
    system = sparse.diags(np.full(count, 1 / noise**2)) + jacobian.T @ sparse.diags(weight) @ jacobian
    return theta, weight, jacobian, system.tocsr()


def _within(points: np.ndarray, measured: np.ndarray, farthest: float) -> np.ndarray:
    """Points held within `farthest` of where they were measured."""
    offset = points - measured
    length = np.linalg.norm(offset, axis=1, keepdims=True)
    return measured + offset * np.minimum(1, farthest / np.maximum(length, 1e-30))


def _large(points: np.ndarray, faces: np.ndarray, min_size: float) -> np.ndarray:
    """Triangles of connected parts whose box has a diagonal of at least `min_size`, (t,) bool."""
    count, part = connected_components(ring_of(faces, len(points)), directed=False)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, part, points)
    np.maximum.at(high, part, points)
    return (np.linalg.norm(high - low, axis=1) >= min_size)[part[faces[:, 0]]]


def without_noise(mesh: Mesh, without: Collection[str] = ()) -> tuple[Mesh, float]:
    """The mesh denoised, and the noise that was found; one with too little to tell from shape is given back itself."""
    noise = noise_of(mesh)
    if noise < DENOISE.least_noise:
        return mesh, 0.0
    return replace(mesh, vertices=denoised(mesh, noise, without)), noise


def denoised(mesh: Mesh, noise: float, without: Collection[str] = ()) -> np.ndarray:
    """The mesh's vertices without their noise, (v, 3) float64.

    Parameters
    ----------
    mesh : Mesh
        Windings may differ from triangle to triangle.
    noise : float
        Standard deviation along the normal, in metres, of what is independent from vertex to vertex
        (`mesh_noise.noise_of`); 0 gives the vertices back as they are.
    """
    if not noise > 0:
        return mesh.vertices
    measured, faces, point_of = welded(mesh, one_place(mesh.vertices))
    # Welding makes triangles that are smaller than its grid into edges.
    valid = (faces != np.roll(faces, 1, 1)).all(1)
    # Parts no larger than outliers have no shape left to find, and stay as they are.
    valid[valid] = _large(measured, faces[valid], LEVELS.sigmas * noise)
    faces = faces[valid]
    if not len(faces):
        return mesh.vertices
    hinges = hinges_of(faces)
    points = measured
    for scale in SCALES:
        normal = point_normals(points, faces)
        theta, weight, jacobian, system = _normal_equations(points, normal, hinges, noise, scale)
        displacement = ((points - measured) * normal).sum(1)
        rhs = -displacement * (1 / noise**2) - jacobian.T @ (weight * theta)
        preconditioner = sparse.diags(1 / system.diagonal())
        step = cg(system, rhs, rtol=DENOISE.tolerance, maxiter=LEVELS.steps, M=preconditioner)[0]
        # The angles are linear over small steps only.
        points = points + np.clip(step, -noise, noise)[:, None] * normal
        points = _within(points, measured, LEVELS.sigmas * noise)
    if "sheets" not in without:
        points = onto_sheets(measured, points, faces, noise)
    return mesh.vertices + (points - measured)[point_of]
