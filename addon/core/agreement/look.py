"""Do the frames agree with the mesh as the poses are read, and if not, read how would they?"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..io.conventions import SCALES, Convention, alternatives
from ..scene.model import Capture, Frame, Pixels
from ..scene.rays import RayScene
from .edges import MeshView, edge_score, mesh_view
from .misalignment import misalignments
from .params import AGREEMENT
from .photometric import consistency
from .views import SmallView, small_views


@dataclass(frozen=True)
class Fit:
    """How well the frames fit the mesh under a convention.

    Attributes
    ----------
    colour : float
        Probability that two views of one spot are more alike than of two spots (0.5 by chance); NaN unknown.
    edge : float
        Probability that pictures change more at the mesh's edges than elsewhere (0.5 by chance); NaN unknown.
    hit : float
        Share of rays through the frames' pixels that meet the mesh.
    """

    convention: Convention
    colour: float
    edge: float
    hit: float

    @property
    def quality(self) -> float:
        """Mean of what is known of `colour` and `edge`; 0 where nothing is."""
        known = [value for value in (self.colour, self.edge) if np.isfinite(value)]
        return float(np.mean(known)) if known and self.hit >= AGREEMENT.least_hit else 0.0


@dataclass(frozen=True)
class Agreement:
    """What looking at the capture showed.

    Attributes
    ----------
    best : Fit or None
        A convention that fits clearly better, where one was looked for and found.
    misaligned : (k,) float
        Pixels by which frames lie beside what other frames show, where that can be measured.
    searched : bool
        Whether other conventions were tried.
    up : str
        The world's axis that is up in the frames; '' where it is none, or frames differ.
    """

    as_read: Fit
    best: Fit | None
    misaligned: np.ndarray
    searched: bool
    up: str = "+z"

    @property
    def fits(self) -> bool:
        """Whether the poses, as read, fit the mesh."""
        return self.best is None and self.as_read.quality >= AGREEMENT.agree

    @property
    def unknown(self) -> bool:
        """Whether there was too little to look at: a single frame, no texture, no overlap."""
        return self.best is None and not np.isfinite(self.as_read.colour)

    def sentences(self) -> list[str]:
        """The messages for a user."""
        sentences = [self.sentence()]
        if self.up not in ("+z", ""):
            convention = replace(self.best.convention if self.best else Convention(), up=self.up)
            sentences.append(
                f"The capture lies on its side: {self.up} is up in its frames; --convention {convention} turns "
                "it upright."
            )
        return sentences

    def sentence(self) -> str:
        """Whether the frames fit the mesh, in words."""
        fit, best = self.as_read, self.best
        if best is not None:
            return (
                f"The frames don't fit the mesh as the poses are read (agreement {fit.quality:.2f} of 1, 0.5 is "
                f"chance), but do with --convention {best.convention} ({best.quality:.2f})."
            )
        if self.fits:
            return f"The frames fit the mesh (agreement {fit.quality:.2f} of 1, 0.5 is chance){self._shift()}."
        if self.unknown:
            return "Too few spots are seen by two frames to tell whether the poses fit the mesh."
        tried = " and no usual convention fits better" if self.searched else ""
        return (
            f"The frames fit the mesh badly (agreement {fit.quality:.2f} of 1, 0.5 is chance){tried}; check poses, "
            "focal lengths and mesh against each other with an overlay picture (info --overlay)."
        )

    def _shift(self) -> str:
        if not len(self.misaligned):
            return ""
        return (
            f", to {np.median(self.misaligned):.1f} pixels in the median and {self.misaligned.max():.1f} in the "
            f"worst of {len(self.misaligned)} frames"
        )


@dataclass(frozen=True)
class _Scene:
    views: list[SmallView]
    capture: Capture
    rays: RayScene

    @cached_property
    def exposed(self) -> bool:
        """Whether all frames' exposures are known."""
        return not any(frame.uncalibrated for frame in self.capture.frames)

    def colour(self, convention: Convention, every: int = 1) -> Fit:
        views = self.views[::every]
        colour, hit = consistency(views, convention.cameras([view.camera for view in views]), self.rays, self.exposed)
        return Fit(convention, colour, float("nan"), hit)

    def mesh_views(self, convention: Convention) -> list[MeshView]:
        cameras = convention.cameras([view.camera for view in self.views])
        mesh = replace(self.capture.mesh)  # whose normals are not needed any more afterwards
        return [mesh_view(camera, mesh, self.rays, not mesh.whole) for camera in cameras]

    def whole(self, fit: Fit) -> Fit:
        return replace(fit, edge=edge_score(self.views, self.mesh_views(fit.convention)))


def look(capture: Capture, read: Callable[[Frame], Pixels], search: bool = True) -> Agreement:
    """Compare frames and mesh, and try other conventions where they don't agree.

    Parameters
    ----------
    read : callable(Frame) -> Pixels
        `io.pixels.read_pixels`.
    search : bool
        Try other conventions where the poses as read don't fit.
    """
    mesh = capture.mesh
    scene = _Scene(small_views(capture.frames, read), capture, RayScene(mesh.vertices, mesh.triangles))
    mesh_views = scene.mesh_views(Convention())
    as_read = replace(scene.colour(Convention()), edge=edge_score(scene.views, mesh_views))
    up = _up(scene.views, Convention())
    if as_read.quality >= AGREEMENT.agree:
        return Agreement(as_read, None, misalignments(scene.views, mesh_views, scene.rays), False, up)
    if _flat(scene.views):
        as_read, search = replace(as_read, colour=np.nan), False
    if not search or len(scene.views) < 2:
        return Agreement(as_read, None, np.zeros(0), False, up)
    best = _search(scene)
    if best is not None and best.quality < max(AGREEMENT.agree, as_read.quality + AGREEMENT.better):
        best = None
    return Agreement(as_read, best, np.zeros(0), True, up if best is None else _up(scene.views, best.convention))


def _flat(views: Sequence[SmallView]) -> bool:
    """Whether all that frames show is of one brightness and colour, such as black: no pose fits better than another."""
    values = np.concatenate([np.zeros((0, 3)), *(view.log[np.isfinite(view.log).all(-1)] for view in views)])
    return not len(values) or not np.ptp(values, axis=0).any()


def _up(views: Sequence[SmallView], convention: Convention) -> str:
    """The signed axis along which most pictures are upright, or ''."""
    if not views:
        return "+z"
    mean = np.mean([camera.camera_to_world[:3, 1] for camera in convention.cameras([v.camera for v in views])], 0)
    axis = int(np.abs(mean).argmax())
    return "" if abs(mean[axis]) < AGREEMENT.upright else ("+" if mean[axis] > 0 else "-") + "xyz"[axis]


def _search(scene: _Scene) -> Fit | None:
    """The convention that fits best: colours first, edges for the best few, the simplest among equals."""
    best: Fit | None = None
    for scale in (1.0, *_likely(scene)):
        every = max(1, len(scene.views) // AGREEMENT.coarse)
        fits = [scene.colour(replace(convention, scale=scale), every) for convention in alternatives()]
        fits = sorted((fit for fit in fits if fit.quality > 0), key=lambda fit: -fit.quality)[: AGREEMENT.coarse]
        for fit in (scene.whole(scene.colour(fit.convention)) for fit in fits):
            if best is None or fit.quality > best.quality + AGREEMENT.tie * np.sign(
                fit.convention.parts - best.convention.parts
            ):
                best = fit
        if best is not None and best.quality >= AGREEMENT.agree:
            break
    return best


def _likely(scene: _Scene) -> list[float]:
    """Those of `SCALES` that spread the cameras over about a third of the mesh, the likeliest first."""
    centres = np.array([view.camera.centre for view in scene.views])
    extent = float(np.ptp(scene.capture.mesh.vertices[scene.capture.mesh.triangles.ravel()], axis=0).max())
    spread = max(float(np.ptp(centres, axis=0).max()), 1e-9)
    distance = {scale: abs(np.log(scale * spread / (extent / 3))) for scale in SCALES}
    return sorted(
        (scale for scale in SCALES if distance[scale] < np.log(AGREEMENT.plausible)), key=distance.__getitem__
    )
