"""What glossy surfaces really reflect onto the room, beyond their median over the frames.

The light field takes a surface to send its L_d into all directions. A highlight is not in that median: a floor under a
lamp sends it towards the ceiling, and no camera stood there; a metal sends the lamp, and its median shows a wall. Once
the lobes are known, the difference is put right, less what of the lobe (of a metal: all) was in the median. What starts
at bright triangles is followed from there (`caustics`); the rest is gathered: along a ray to a glossy element, its lobe
towards where the ray came from. The rest of E stays as it was.
"""

from collections.abc import Collection

import numpy as np

from ...brdf.material import ObjectMaterial
from ...light.emitters import bright_triangles
from ...light.environment import Environment
from ...light.field import LightField
from ...light.interpolate import interpolated
from ...light.irradiance import gather
from ...light.lobes import GRID, highlight
from ...light.over_surface import block_step, finest_spacing
from ...light.texel_blocks import TexelBlocks
from ...parallel import for_blocks
from ...progress import Progress, Rounds
from ...scene.rays import Hits
from .caustics import Gloss, caustics
from .params import GLOSSY


class Excess(LightField):
    """The room sending nothing but what its glossy elements send beyond their part of the light field.

    Gathered by chance, a small lamp's highlights come as fireflies: in a kitchen with copper shades single places had
    twice their light, and there were dark discs on the albedo around them (23.4 dB; 26.4 with `from_bright` apart).

    Parameters
    ----------
    room : LightField
        With all its light.
    specular : (n, 3) float32
        Part of each element's L_d that is specular.
    """

    def __init__(self, room: LightField, materials: tuple[ObjectMaterial, ...], specular: np.ndarray, seed: int = 0):
        dark = room.with_light(np.zeros_like(room.radiance), Environment.dark(), ())
        self.__dict__.update(dark.__dict__)
        self.mirrors = ()  # light is followed over them in the room
        self._lit, self._sources, self._seed = room, bright_triangles(room), seed
        self._inside = specular.copy()
        alpha, kind = np.zeros(len(room.atlas), np.float32), np.zeros(len(room.atlas), np.int8)
        self._f0, microfacets = np.zeros((len(room.atlas), 3), np.float32), []
        followed = {mirror.object_id for mirror in room.mirrors}
        for material in materials:
            if material.model.microfacets is None or material.alpha is None or material.object_id in followed:
                continue
            elements = room.atlas.elements_of(material.object_id)
            alpha[elements] = max(float(material.alpha), float(GRID[0]))
            if material.model.microfacets not in microfacets:
                microfacets.append(material.model.microfacets)
            kind[elements] = microfacets.index(material.model.microfacets)
            self._f0[elements] = material.f0
            if not material.model.has_diffuse:
                self._inside[elements] = room.radiance[elements]
        self._gloss = Gloss(alpha, self._f0, self._inside, tuple(microfacets), kind)
        # What bright triangles send is followed from there.
        self._aimed = self._sources.density[room.atlas.triangle] > 0
        self._room = room.with_light(np.where(self._aimed[:, None], 0, room.radiance))
        self._bright = bright_triangles(self._room)

    @property
    def any(self) -> bool:
        """Whether there is anything glossy at all."""
        return bool(self._gloss.alpha.any())

    def from_bright(self, threads: int = 0) -> np.ndarray:
        """The part of the excess that starts at bright triangles, at every element (`caustics`)."""
        return caustics(self._lit, self._sources, self._gloss, self._seed, threads=threads)

    def arriving(
        self,
        hits: Hits,
        element: np.ndarray,
        directions: np.ndarray,
        dark_in_mirrors: np.ndarray | None = None,
        origins: np.ndarray | None = None,
    ) -> np.ndarray:
        """As `LightField.arriving`; what is behind a surface gets nothing from it."""
        result = np.zeros((len(element), 3), np.float32)
        facing = np.einsum("ij,ij->i", directions, self._room.atlas.normal[element]) < 0
        lit = np.flatnonzero((element >= 0) & facing)
        for group, microfacets, alpha in self._gloss.by_lobe(element[lit]):
            at = lit[group]
            elements = element[at]
            radiance = highlight(
                self._room, self._bright, elements, -directions[at], alpha, self._f0[elements], microfacets,
                rays=GLOSSY.lobe_rays, seed=self._seed + int(at[0]) + len(at),
            )  # fmt: skip
            result[at] = radiance - np.where(self._aimed[elements, None], 0, self._inside[elements])
        return result


def glossy_light(
    excess: Excess,
    element: np.ndarray,
    irradiance: np.ndarray,
    *,
    threads: int = 0,
    seed: int = 0,
    progress: Progress | None = None,
    share: tuple[float, float] = (0.0, 1.0),
    without: Collection[str] = (),
) -> np.ndarray:
    """What is to be added to E, radiance * steradian, (m, 3) float32.

    Parameters
    ----------
    element : (m,) int
    irradiance : (m, 3) float32
        E without it.
    share : (float, float)
        From where to where the stage's progress goes.
    """
    if not excess.any or not len(element):
        return np.zeros((len(element), 3), np.float32)
    atlas = excess.atlas
    bright = bright_triangles(excess)  # none
    # How far places may differ is judged beside the room's light: the excess itself is next to nothing in most of them.
    level = np.float32(np.median(irradiance))
    rounds, steps = Rounds(progress, *share), {"count": 0}

    def gathered(index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """E and `level`, (k, 3), and the radius."""
        value, radius = np.empty((len(index), 3), np.float32), np.empty(len(index), np.float32)
        steps["count"] += 1

        def run(part: slice) -> None:
            at, block_seed = element[index[part]], seed + 7919 * steps["count"] + part.start
            gathered_excess, radius[part], _ = gather(
                excess, bright, atlas.position[at], atlas.normal[at], GLOSSY.rays, 0, block_seed
            )
            value[part] = level + gathered_excess

        for_blocks(run, len(index), 1 << 11, threads, rounds)
        rounds.next()
        return value, radius

    def evaluated(index: np.ndarray) -> np.ndarray:
        finest = finest_spacing(atlas, GLOSSY.finest_share)
        at = element[index]
        return interpolated(atlas.position[at], atlas.normal[at], lambda i: gathered(index[i]), finest, threads)[0]

    added = TexelBlocks(atlas, element, threads).evaluate(evaluated, block_step(atlas), np.inf) - level
    if "caustics" not in without:
        added += excess.from_bright(threads)[element]
    return np.maximum(added, -GLOSSY.most_taken * irradiance).astype(np.float32)
