"""The numbers that make the stated errors true, and the measurement behind them.

Chosen on four rooms like the demo's, of other colours, gloss, lamps and walks, rendered by Cycles in three sizes (72x54
to 128x96 pixels; `tests/blender/evidence/known_rooms.py`) by Blender 4.5 and by 5.2, and on eight captures of six
furnished rooms (`scripts/qa_rooms`), so that 90 % intervals hold 85 to 95 % of the truth in the mean over the small
rooms and in that over the furnished ones, and score well there (`docs/evidence.md`: what came out, and what that is
worth). The living room's figures were seen, not aimed at.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class CalibrationParams:
    """Errors that an interval is made of.

    Attributes
    ----------
    solved, roughly : float
        Relative error of light that no frame looked at: lamps and a sun that were solved for; sky that was, and,
        besides the error of their albedo, surfaces: the light on them is gathered roughly. (An unseen ceiling lamp came
        out at 0.93 to 1.08 of its radiance in the rooms, at 0.99 in the living room; four bulbs in shades at 0.98 to
        1.43: what their shades' unseen insides throw is put to them.)
    poorly : float
        Relative error of what is known poorly: clipped surfaces (a lower bound), what was only seen at depth edges
        (another surface is mixed in; thin things: 0.4 to 0.7), the specular part that was taken out (psi is known to 30
        %).
    surfaces : float
        Of the error of unseen surfaces' light: each errs by itself, and E adds many of them up.
    light_floor : float
        Relative error of E that gathering it again does not show: texels stand for places, L_d is a median.
    noise_left : float
        Of the error of E that gathering it again shows, as far as it is the albedo's: neighbours shrink that.
    own : float
        Of the error that an element is left with once its neighbours have shrunk it: the error it starts from
        (`neighbourhood.relative_error`) is more than what was found.
    texture : float
        Of the contrast around a texel: pixels blur a texture and misplace it by about a texel. It was 1.0 before L_d
        was made sharper (`lit_diffuse.sharpen`); since then 95.2 % of the rooms' texels were held by that, and 94.4 %
        by 0.7 (16 frames of 72x54).
    filled, filled_floor : float
        Error of what no frame saw: so much of the spread of its object's albedo, and at least so much.
    barely_seen : float
        Besides, of what hardly anything was seen: a ceiling known from its edges came out 2.7 times too bright.
    left : float
        Albedo that an undetected highlight adds: 0.04 reflected at normal incidence by a dielectric comes to 0.025
        where a broad lobe is not found, and to nothing on what is diffuse. What was taken out leaves as much, besides.
    nothing_known : float
        Most that a standard error of albedo can be.
    of_object : float
        Error of an object's mean albedo, relative to the root mean square of its texels' errors: most of those is
        common to all of an object. 88 % of the objects' means are held in the small rooms, 99 % in the furnished ones.
    worst : float
        Where next to no light comes, the logarithm may be off by anything.
    prior_spots : int
        An object's own error counts as much as the room's from so many spots on.
    around : int
        Edge in texels of the window over which texture is judged.
    lobe_rays : int
        For each pixel of a glossy object.
    """

    solved: float = 0.1
    poorly: float = 0.4
    roughly: float = 0.25
    surfaces: float = 0.5
    light_floor: float = 0.015
    noise_left: float = 0.4
    own: float = 0.6
    texture: float = 0.7
    filled: float = 0.4
    filled_floor: float = 0.03
    barely_seen: float = 0.5
    left: float = 0.008
    nothing_known: float = 0.4
    of_object: float = 0.6
    worst: float = 1.0
    prior_spots: int = 10
    around: int = 5
    lobe_rays: int = 24


CALIBRATION = CalibrationParams()
