"""What a reflectance model is to the rest of the program: one object that does all that depends on the model.

A model is one file of this folder, or of another package (`registry`): a `Brdf` with a name. Nobody else compares
names; who wants to know something of a model asks it.

The specular part of a model is linear in F0, s being how Fresnel's term rises with the angle (`fresnel`):

    f_s = (G D)(alpha) (F0 (1 - s) + s)

so the light transport needs G D alone, of many widths at once (`Microfacets`), and the fit is linear least squares.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from .fresnel import fresnel

F0 = float | tuple[float, float, float]
"""Reflectance at normal incidence, 0...1, linear Rec.709: one number, or three of a coloured one."""


class Parameters(Protocol):
    """What is known of one object beside its model; `material.ObjectMaterial` says what each of them is."""

    @property
    def alpha(self) -> float | None: ...
    @property
    def f0(self) -> F0 | None: ...
    @property
    def emission(self) -> tuple[float, float, float] | None: ...
    @property
    def unlit(self) -> float | None: ...
    @property
    def transmission(self) -> float | None: ...
    @property
    def surfaces(self) -> float | None: ...


def roughness(of: Parameters) -> float | None:
    """Blender's Roughness, the root of GGX's alpha; None where there is no lobe."""
    return None if of.alpha is None else math.sqrt(min(max(of.alpha, 0.0), 1.0))


class Microfacets(Protocol):
    """Masking and distribution of a rough surface's facets, G D, with 1 / (4 (n.w) (n.wo)) in it."""

    def lobes(self, n_w: np.ndarray, n_wo: np.ndarray, sin2_h: np.ndarray, grid: np.ndarray) -> np.ndarray:
        """G D of every width of a grid, 1 / steradian.

        Parameters
        ----------
        n_w : (m, k) float32
            Cosine of the incoming direction.
        n_wo : (m, 1) float32
            Cosine of the outgoing direction.
        sin2_h : (m, k) float32
            1 - (n.h)^2.
        grid : (p,) float
            alpha.

        Returns
        -------
        (m, p, k) float32
        """

    def reflect(self, wi: np.ndarray, square: np.ndarray, alpha: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Directions drawn from the lobe, in the local frame (normal = +Z).

        Parameters
        ----------
        wi : (3, m) float32
            Where the light comes from, unit, z > 0.
        square : (2, m) float32
            Random numbers in [0, 1).

        Returns
        -------
        wo : (3, m) float32
            Below the surface where the draw has failed; its weight is 0.
        w_h : (m,) float32
            Cosine between wi and the half vector.
        weight : (m,) float32
            G D (n.wo) over the density of wo.
        """


@dataclass(frozen=True)
class Prior:
    """What is known of F0 before any frame: a normal distribution's mean and standard deviation."""

    psi: float
    sigma: float


@dataclass(frozen=True)
class Constraints:
    """How the fit of a lobe is held (`passes.specular.fit`, where F0 is called psi as in the paper).

    Attributes
    ----------
    coloured : bool
        F0 for each channel; otherwise one for all.
    least_psi : float
        Lower bound of F0.
    prior : Prior or None
        Of F0.
    """

    coloured: bool = False
    least_psi: float = 0.0
    prior: Prior | None = None


@dataclass(frozen=True)
class Principled:
    """Inputs of Blender's Principled BSDF under which an object looks as its model says.

    Attributes
    ----------
    base_color : (3,) tuple of float or None
        Linear Rec.709; None: the image over the atlas, mid-grey where there is none.
    roughness : float or None
        Square root of GGX's alpha; None leaves Blender's own, where no lobe shows it.
    specular_level : float
        "Specular IOR Level": 0.5 is what `ior` says, 0 no lobe at all.
    alpha : float
        Opacity.
    emission : (3,) tuple of float or None
        Radiance, linear Rec.709; None of what gives no light.
    further : dict of str to float
        Further inputs by Blender's own names, such as "Diffuse Roughness"; those that a version lacks are left out.
    """

    base_color: tuple[float, float, float] | None = None
    roughness: float | None = None
    metallic: float = 0.0
    ior: float = 1.5
    specular_level: float = 0.0
    alpha: float = 1.0
    emission: tuple[float, float, float] | None = None
    further: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Brdf:
    """A reflectance model.

    Attributes
    ----------
    name : str
        In materials.json, overrides.json and .blend files.
    label, text : str
        What the panel calls it, and a sentence on it.
    colour : (3,) tuple of int
        sRGB, in pictures of which object has which model.
    icon : str
        Blender's name of an icon.
    has_diffuse : bool
        There is a diffuse part, with an albedo for each spot.
    microfacets : Microfacets or None
        The specular lobe; None where there is none.
    gives_light, see_through : bool
        A lamp; what shows what lies behind it. Neither has an albedo that could be measured.
    parameters : tuple of str
        What of an object of this model may be given: 'roughness', 'f0', 'base_color'.
    can_be_given : bool
        Whether the model itself may be; what can't has to be found by a run.
    constraints : Constraints
        Of the lobe's fit.
    """

    name: str
    label: str
    text: str
    colour: tuple[int, int, int]
    icon: str = "MATERIAL"
    has_diffuse: bool = True
    microfacets: Microfacets | None = None
    gives_light: bool = False
    see_through: bool = False
    parameters: tuple[str, ...] = ()
    can_be_given: bool = True
    constraints: Constraints = Constraints()

    def __str__(self) -> str:
        return self.name

    @property
    def has_lobe(self) -> bool:
        """Whether there is a specular lobe."""
        return self.microfacets is not None

    @property
    def layered(self) -> bool:
        """Whether its lobe lies over a diffuse part."""
        return self.has_lobe and self.has_diffuse

    @property
    def lobe_alone(self) -> bool:
        """Whether all that it reflects is its lobe: its colour is F0 then."""
        return self.has_lobe and not self.has_diffuse

    @property
    def has_albedo(self) -> bool:
        """Whether its diffuse albedo is one that frames show."""
        return self.has_diffuse and not self.see_through

    def evaluate(
        self, of: Parameters, albedo: np.ndarray, n_w: np.ndarray, n_wo: np.ndarray, n_h: np.ndarray, w_h: np.ndarray
    ) -> np.ndarray:
        """The BRDF, 1 / steradian: diffuse part plus lobe.

        Parameters
        ----------
        albedo : (3,) float
        n_w, n_wo, n_h, w_h : (m,) float
            Cosines between normal n, half vector h and the directions w and wo; all of them in front of the surface.

        Returns
        -------
        (m, 3) float64
        """
        result = np.zeros((len(n_w), 3))
        if self.has_diffuse:
            result += np.asarray(albedo) / np.pi
        if self.microfacets is not None and of.alpha is not None and of.f0 is not None:
            w, wo, sin2_h = (np.asarray(x, np.float32)[:, None] for x in (n_w, n_wo, (1 - n_h) * (1 + n_h)))
            lobe = self.microfacets.lobes(w, wo, sin2_h, np.array([of.alpha]))[:, 0]
            result += lobe * fresnel(np.asarray(w_h)[:, None], np.broadcast_to(of.f0, 3))
        return result

    def as_f0(self, value: Any) -> F0 | None:
        """F0 as this model has it, one number or three, of one or three (a mean, or the same three times)."""
        if not self.has_lobe or value is None:
            return None
        return float(np.mean(value))

    def plausible_f0(self, base_color: Any = None) -> F0 | None:
        """F0 of an object whose F0 no frame shows; `base_color` ((3,)) is the colour it is known by, if any."""
        return None

    def base_color(self, albedo: np.ndarray, of: Parameters) -> np.ndarray:
        """Principled's Base Color (k, 3) under which an object's elements reflect as this model says.

        Parameters
        ----------
        albedo : (k, 3) float32
            Diffuse albedo, linear Rec.709.
        """
        return albedo

    def principled(self, of: Parameters) -> Principled:
        """How Blender is to show it."""
        return Principled()
