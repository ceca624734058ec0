"""Numerically hard cases, each with an answer that is known beforehand.

Whole runs over small captures on disk: no value may be none, nothing may be wrong in silence. What can't be known has
to be marked: by `Albedo.origin`, an element's tier, a material's note, a warning in the report.

| theme | module | cases |
|---|---|---|
| light | `test_light` | furnaces; a black floor under bright light; lamps 1e5 brighter than a wall, clipped, masked; \
exposures; a white box; cavities without light; holes |
| material | `test_material` | alpha 0.01 and 1, F0 0 and 1, lobes in a furnace up to grazing views |
| observations | `test_observations` | 1 to 6 and 5,000 of them, sorted, tied, grazing, beyond a half float |
| geometry | `test_geometry` | rooms of 1 cm and 1 km, 10 km from the origin, slivers, coplanar walls, sheets |

`pytest -m hard_case` runs them; `python -m tests.hard_cases [FILE]` runs them and gives the table of every case with
its known answer, its tolerance and what was measured (docs/hard_cases.md).
"""
