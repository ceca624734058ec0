"""A room under construction: objects are added one by one, in colours and gloss that the seed varies a little."""

from dataclasses import dataclass, field

import numpy as np

from addon.bridge.demo.room import Paint, RoomObject, box, grid

from .shapes import tube, wall


@dataclass(frozen=True)
class Finish(Paint):
    """A paint that may also be a metal (its albedo is then its F0) or thin clear glass."""

    metallic: bool = False
    glass: bool = False


@dataclass
class FurnishedRoom:
    """A room under construction.

    Attributes
    ----------
    walk : tuple of float
        Low x, low y, high x, high y of where the camera may be.
    pitch : tuple of float
        Lowest and highest gaze, degrees.
    sky, ground : tuple of float
        Radiance from outside, above and below the horizon.
    sun : tuple or None
        Where it shines to (3,), colour (3,), irradiance.
    windows : list
        Rectangles (origin, across, up) that light comes in by.
    """

    name: str
    seed: int
    size: tuple[float, float, float]
    walk: tuple[float, float, float, float]
    pitch: tuple[float, float] = (-45, 35)
    sky: tuple[float, float, float] = (0, 0, 0)
    ground: tuple[float, float, float] = (0, 0, 0)
    sun: tuple | None = None
    windows: list = field(default_factory=list)
    objects: list[RoomObject] = field(default_factory=list)

    def __post_init__(self):
        self.rng = np.random.default_rng([self.seed, sum(map(ord, self.name))])

    def add(self, class_name: str, shapes, *finishes: Finish, slots=None, triangles: bool = False) -> None:
        """One more object."""
        quads, uv = np.concatenate([s[0] for s in shapes]), np.concatenate([s[1] for s in shapes])
        slot = np.repeat([0] * len(shapes) if slots is None else slots, [len(s[0]) for s in shapes])
        self.objects.append(RoomObject(len(self.objects), class_name, quads, uv, slot, finishes, triangles))

    def add_round(self, class_name: str, shapes, finish: Finish) -> None:
        """One more object that is shaded smooth, its quads split in triangles."""
        self.add(class_name, shapes, finish, triangles=True)

    def tint(self, colour, spread: float = 0.12) -> np.ndarray:
        """The colour, varied a little by the seed."""
        return np.clip(np.asarray(colour) * self.rng.uniform(1 - spread, 1 + spread, 3), 0.005, 0.92)

    def diffuse(self, *colour) -> Finish:
        return Finish(np.float32(self.tint(colour)))

    def matt_picture(self, picture) -> Finish:
        """Diffuse, with a texture."""
        return Finish(picture)

    def gloss(self, roughness: float, colour, spread: float = 0.2) -> Finish:
        """Plastic, lacquer, ceramics: F0 .04."""
        colour = np.asarray(colour, np.float32)
        colour = np.float32(self.tint(colour)) if colour.ndim == 1 else colour
        return Finish(colour, float(roughness * self.rng.uniform(1 - spread, 1 + spread)), 0.04)

    def metal(self, roughness: float, colour) -> Finish:
        """F0 by channel."""
        return Finish(np.float32(colour), roughness, 0.5, metallic=True)

    def lamp(self, *radiance) -> Finish:
        """A lamp of that radiance, varied a little by the seed."""
        return Finish(
            np.zeros(3, np.float32), emission=tuple(float(r * self.rng.uniform(0.85, 1.15)) for r in radiance)
        )

    def shell(self, floor: Finish, ceiling: Finish, walls, holes=()) -> None:
        """Floor, ceiling and four walls (y = 0, x = X, y = Y, x = 0; equal finishes make one object); holes by wall."""
        x, y, z = self.size
        self.add("floor", [grid((0, 0, 0), (x, 0, 0), (0, y, 0), 14, 14)], floor)
        self.add("ceiling", [grid((0, y, z), (x, 0, 0), (0, -y, 0), 14, 14)], ceiling)
        frames = [((x, 0, 0), (-x, 0, 0)), ((x, y, 0), (0, -y, 0)), ((0, y, 0), (x, 0, 0)), ((0, 0, 0), (0, y, 0))]
        holes = dict(holes)
        parts = {}
        for k, (finish, (origin, across)) in enumerate(zip(walls, frames)):
            parts.setdefault(id(finish), (finish, []))[1].append(wall(origin, across, (0, 0, z), holes.get(k, ())))
            for a, b, c, d in holes.get(k, ()):
                unit = np.asarray(across, float) / np.linalg.norm(across)
                self.windows.append(
                    (np.asarray(origin, float) + unit * a + (0, 0, c), unit * (b - a), np.array([0, 0, d - c]))
                )
        for finish, shapes in parts.values():
            self.add("wall", shapes, finish)

    def surround(self, times: float) -> None:
        """A ground below the floor that goes on around the room, `times` its longer side wide."""
        x, y, _ = self.size
        edge = times * max(x, y)
        corner = (x / 2 - edge / 2, y / 2 - edge / 2, -0.3)
        self.add("ground", [grid(corner, (edge, 0, 0), (0, edge, 0), 40, 40)], self.diffuse(0.25, 0.24, 0.18))

    def window_frame(self, finish: Finish) -> None:
        """A frame of bars around and across each window."""
        for origin, across, up in self.windows:
            bars = [tube([at, at + up], 0.03, 6) for at in (origin, origin + across * 0.5, origin + across)]
            bars += [tube([at, at + across], 0.03, 6) for at in (origin, origin + up)]
            self.add("window frame", bars, finish)


STEEL, CHROME = (0.56, 0.55, 0.53), (0.55, 0.56, 0.57)
BRASS, COPPER, GOLD = (0.76, 0.6, 0.33), (0.9, 0.58, 0.45), (0.98, 0.76, 0.36)


def legs(x0, y0, x1, y1, height, thick):
    return [box((a, b, 0.002), (a + thick, b + thick, height)) for a in (x0, x1 - thick) for b in (y0, y1 - thick)]
