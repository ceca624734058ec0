"""Parameters of the choice of models and lobes; what each part gains: docs/ablation.md."""

from dataclasses import dataclass

import numpy as np

from ...significance import LEVELS


@dataclass(frozen=True)
class FitParams:
    """How many observations the fits look at, and how wide their lobes may be.

    Attributes
    ----------
    views : int
        Views of each of the `LEVELS.of_object` elements that the fit looks at.
    part_elements : int
        Elements of a part that is found by shape alone: it is a whole wall, with other things on it. Five phone-made
        rooms: models right on .66 of the pixels with 350, on .77 with 1050 (bathroom .47 to .90, office .74 to .88, a
        kitchen .54 to .52).
    candidates, expecting, narrow_phi : int, int, float
        Times those elements that are asked whether they expect a highlight, rays of each view for that, and the width
        of its lobe (`highlight-sampling`).
    looks_like_none : float
        A metal whose spread over the fitted views is so many times the other's is not compared over all views.
    broadest_phi : float
        A lobe broader than this, of a metal or over a diffuse part, can't be told from a diffuse surface, but for one
        over a diffuse part that takes `LEVELS.gain` off the cost by `LEVELS.sigmas`: in nine rooms three varnished
        things, one a table with .61 (29 standard errors), and nothing diffuse (.12 by .4, .09 by 1.9, .05 by 3.3).
    crease : float
        Radians by which two faces must turn for an edge between them (`pixel-curvature`); Blender's own for smooth
        shading.
    unresolved : float
        Roughness up to which the frames show a mirror: a lobe of phi 0.03 is as wide as a few pixels.
    """

    part_elements: int = 3 * LEVELS.of_object
    views: int = 12
    candidates: int = 20
    expecting: int = 4
    narrow_phi: float = 0.05
    looks_like_none: float = 1.5
    broadest_phi: float = 0.5
    crease: float = float(np.radians(30))
    unresolved: float = 0.17


FIT = FitParams()


@dataclass(frozen=True)
class ChoiceParams:
    """When a lobe, or a metal, is accepted (`models`, `of_class`).

    Attributes
    ----------
    bare : float
        A metal has no diffuse part. Its lobe alone, with nothing of each element's own, may cost up to so many times
        what each element's own mean does (errors of the light field and of the mesh): metals in the living room had 0.1
        to 1.4, dielectrics and diffuse objects whose lobe looked like a metal's 2.4 to 60, there and in four small
        rooms. What an object's own lobe leaves of a dielectric's cost counts as a factor: in eleven rooms 32 of 33 true
        metals had .1 to 2.0 then (three of them 2.0 to 2.25 without it, one 3.4), and seven of nine others, as sure of
        their lobe, 2.8 and more (a keyboard .5, a window frame 1.7).
    min_gain : float
        A lobe must lower the cost on elements that its fit has not seen by this share, and by this many standard errors
        (`LEVELS.sigmas`). A metal must also beat a dielectric over a diffuse part, by `LEVELS.likely` only, as it has
        to do without a diffuse part besides. Below three others of its class decide: of 31 true metals in nine rooms
        two had less, a black keyboard 1.9 or 2.1. What takes `LEVELS.gain` off need only be likely: few elements show a
        small highlight, but what they show nothing else explains (a bathroom's tiles: gain .16 at 2.2 standard errors;
        nothing truly diffuse gained a tenth with less than 3). Not of a handful of elements, whose standard error is no
        better known than that.
    sure : float
        Standard errors that a model or lobe that an artist gives counts for when others of its class adopt it.
    """

    bare: float = 2.0
    min_gain: float = 0.02
    sure: float = 1000.0


CHOICE = ChoiceParams()


@dataclass(frozen=True)
class LooksParams:
    """When a metal or a coat is recognised by appearance (`metal-by-looks`, `coat-by-looks` in the ablation).

    Attributes
    ----------
    ratio : float
        An object of one colour is metal, or coated, if that leaves less than this share of the spread that diffuse and
        dielectric leave, by `LEVELS.sigmas`; by whatever it is if others of its class are metal. Of 166 objects in the
        living room and five others, metals had 0.2 to 1.1 (the half of them below 0.8), everything else 0.92 and more,
        but for what `metal_spread` leaves out and a pane of glass (0.58); reddish wood in a perturbed scan had 0.78 and
        an F0 that no metal has (`metal_by_looks`). Of what was called Lambertian in six rooms and two perturbed scans,
        fourteen coated objects had less (black tubes 0.42, a hand rail 0.74, soap 0.75, a plant pot 0.89); truly
        diffuse objects had 0.94 and more, but for what `coated_spread` says.
    metal_spread : float
        What follows diffuse light as closely as this may be diffuse: errors of E and A are of that size.
    coated_spread : tuple[float, float]
        What follows diffuse light as closely as the first may be diffuse (a bath mat: 0.04); what does not follow
        coated light to the second is not explained (a cord as thick as a pixel: 0.65 diffuse, 0.40 coated; of a table
        0.35).
    """

    ratio: float = 0.9
    metal_spread: float = 0.15
    coated_spread: tuple[float, float] = (0.1, 0.37)


LOOKS = LooksParams()


@dataclass(frozen=True)
class IntervalParams:
    """Of the intervals of roughness and F0 (`intervals`).

    Attributes
    ----------
    groups, roughness_systematic : int, float
        Standard error of Blender's roughness that all elements share; the grid of phi alone has steps of 0.06. Of 24
        glossy objects in eight rendered rooms (`tests/blender/evidence`) the 90 % intervals then hold 22, in the living
        room 23 of 23; the jackknife alone gives 0.02 in the median where 0.07 is true.
    specular_systematic : float
        The same of log psi: 23 of those 24 are held, in the living room 20 of 23; psi came out between 0.6 and 2.2 of
        the truth.
    metal_systematic : float
        The same of log F0 of metals, measured on five in the living room only (0.89 to 1.15 of the truth).
    adopted : float
        Standard error of a roughness that was taken over from another object of the class.
    by_looks : float
        The same of one that is determined by appearance (`one_colour`), which is too broad as a rule: 13 metals in
        three rooms came out -.01 to .25 above the truth (.13 in the root mean square); 3 of 6 in a fourth, rims of
        spots mixed with their lamps, .5. These intervals hold 16 of the 19.
    """

    groups: int = 6
    roughness_systematic: float = 0.07
    specular_systematic: float = 0.45
    metal_systematic: float = 0.15
    adopted: float = 0.1
    by_looks: float = 0.2


INTERVALS = IntervalParams()
