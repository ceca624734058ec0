"""The constants that make the stated errors true, and the measurement behind them.

Chosen on four rooms like the demo's, of other colours, gloss, lamps and walks, rendered by Cycles in three sizes (72x54
to 128x96 pixels; `tests/blender/evidence/known_rooms.py`) by Blender 4.5 and by 5.2, and on eight captures of six
furnished rooms (`scripts/qa_rooms`), so that 90 % intervals hold 85 to 95 % of the truth in the mean over the small
rooms and in that over the furnished ones, and score well there (`docs/evidence.md`: what came out, and what that is
worth). The living room's figures were seen, not aimed at.
"""

from __future__ import annotations

LAMP_UNSURE, SKY_UNSURE, CLIPPED_UNSURE, ROUGH_LIGHT = 0.1, 0.2, 0.4, 0.25
"""Relative error of light that no frame looked at: lamps and sky that were solved for; clipped surfaces, known as a
lower bound; and, besides the error of their albedo, surfaces: the light on them is gathered roughly. (An unseen ceiling
lamp came out at 0.93 to 1.08 of its radiance in the rooms, at 0.99 in the living room; four bulbs in shades at 0.93 to
1.24.)"""
SUN_UNSURE = 0.1
"""The same of a sun that was solved for."""
SURFACES = 0.5
"""Of the error of unseen surfaces' light: each errs by itself, and E adds many of them up."""
LIGHT_FLOOR = 0.015
"""Relative error of E that gathering it again does not show: texels stand for places, L_d is a median."""
NOISE_LEFT = 0.4
"""Of the error of E that gathering it again shows, as far as it is the albedo's: neighbours steady that."""
OWN = 0.6
"""Of the error that an element is left with once its neighbours have shrunk it: the error it starts from
(`neighbourhood.relative_error`) is more than what was found."""
TEXTURE = 0.7
"""Of the contrast around a texel: pixels blur a texture and misplace it by about a texel. It was 1.0 before L_d was
made sharper (`lit_diffuse.sharpen`); since then 95.2 % of the rooms' texels were held by that, and 94.4 % by 0.7 (16
frames of 72x54)."""
AT_EDGES = 0.4
"""Relative error of what was only seen at depth edges: another surface is mixed in (thin things: 0.4 to 0.7)."""
FILLED, FILLED_FLOOR = 0.4, 0.03
"""Error of what no frame saw: so much of the spread of its object's albedo, and at least so much."""
BARELY_SEEN = 0.5
"""Besides, of what hardly anything was seen: a ceiling known from its edges came out 2.7 times too bright."""
LEFT = 0.008
"""Albedo that an undetected highlight adds: 0.04 reflected at normal incidence by a dielectric comes to 0.025 where a
broad lobe is not found, and to nothing on what is matt."""
TAKEN, TAKEN_FLOOR = 0.4, 0.005
"""Error of the specular part that was taken out, relative to it, and at least, in albedo: psi is known to 30 %."""
NOTHING_KNOWN = 0.4
"""Most that a standard error of albedo can be."""
OF_OBJECT = 0.6
"""Error of an object's mean albedo, relative to the root mean square of its texels' errors: most of those is common to
all of an object. 88 % of the objects' means are held in the small rooms, 99 % in the furnished ones."""
