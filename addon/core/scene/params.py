"""Parameters of the geometry: what counts as seen, as a side, as a crease, as noise."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class VisibilityParams:
    """What of a frame counts as seen, and how sure (`visibility`, `lit_diffuse`).

    Attributes
    ----------
    min_cosine : float
        Views more grazing than this are dropped: their pixel covers too much surface.
    depth_tolerance : float
        A neighbouring pixel whose hit lies further than this share of the distance off the pixel's own plane lies
        beyond a depth edge.
    enough : int
        Clean observations from which on an element does without those at edges.
    """

    min_cosine: float = 0.2
    depth_tolerance: float = 0.02
    enough: int = 3


VISIBILITY = VisibilityParams()


@dataclass(frozen=True)
class CoplanarParams:
    """What lies in one plane.

    Attributes
    ----------
    turn : float
        Radians between two normals, or a normal and the plane's: what is left of a scan's noise, no skirting's slope.
    off : float
        Metres to either side.
    """

    turn: float = float(np.radians(15))
    off: float = 0.05


COPLANAR = CoplanarParams()


@dataclass(frozen=True)
class SmallParams:
    """Frames as they are compared with one another (`poses`, `radiometric_calibration`).

    Attributes
    ----------
    width : int
        Larger pictures are averaged down to about so many pixels across, as poses and mesh are no better.
    blur : float
        Pixels, standard deviation, that gradients are taken over, and codes compared.
    off : int
        Pixels that poses may be off by: so far around a place all is looked at, and so wide an edge is left out.
    """

    width: int = 480
    blur: float = 1.0
    off: int = 3


SMALL = SmallParams()


@dataclass(frozen=True)
class FrameChoiceParams:
    """Which frames show something new (`frame_choice`); docs/speed-against-error.md has the error against them.

    Attributes
    ----------
    few : int
        Frames that are all taken, as somebody chose them: of 96 of a kitchen, each has something that another lacks.
    rays : int
        Into each frame.
    enough : int
        Frames that show a cell from one direction at one resolution, from which on another one adds nothing.
    """

    few: int = 100
    rays: int = 2000
    enough: int = 8


FRAME_CHOICE = FrameChoiceParams()


@dataclass(frozen=True)
class SampleParams:
    """Observations that are kept one by one (`samples`).

    Attributes
    ----------
    in_all : int
        Elements whose observations are kept; of one object `LEVELS.sample`.
    frames : int
        With more frames, each observation is kept with the chance that this many frames would leave of it.
    """

    in_all: int = 150_000
    frames: int = 200


SAMPLES = SampleParams()


@dataclass(frozen=True)
class SidesParams:
    """What is given a second side, and which side faces the room (`two_sides`, `shells`, `orientation`, `vote`).

    Attributes
    ----------
    least_share, least_rays : float, int
        A sheet is given two sides if this share of the rays that met it, and so many, met the side that is seen less;
        or half that share, if they are `LEVELS.few` at least: a floor lamp's shade had 17 of 590, and its inner side's
        light was reflected onto the wall behind it. Bent tubes have 4 to 10 of some hundred at their ends, and second
        sides would halve what shows them. So is a triangle that pixels vote for either side of.
    least_of_object, least_of_room : float
        Sheets that are less of their object's surface, and of the room's, are left as they are: single leaves of a
        plant, whose two sides are alike, only cost elements, and views that its other elements would be judged by.
    gap : float
        Between a sheet's two sides where it is rendered, as a share of the room's diagonal: 0.3 mm in a room of 7 m.
    upright : float
        A triangle's corners go along the sheet's normals where these agree with its own at least by this cosine.
    pixel_step : int
        Every fourth pixel in x and y votes.
    max_rays : int
        Rays over all frames; of larger captures every second, third ... pixel votes.
    flat : float
        Length of a lamp's mean normal from which on it is no globe: 1 in a plane, .94 to 1 of nine fused panels, .5 of
        half a globe, .4 of a fused bulb of which six tenths are there.
    """

    least_share: float = 0.05
    least_rays: int = 4
    least_of_object: float = 0.1
    least_of_room: float = 0.01
    gap: float = 4e-5
    upright: float = 0.3
    pixel_step: int = 4
    max_rays: int = 20_000_000
    flat: float = 0.7


SIDES = SidesParams()


@dataclass(frozen=True)
class CreaseParams:
    """How much less sure irradiance is beside creases (`creases`).

    Attributes
    ----------
    reach : float
        Texels from the edge up to which it is felt, less and less.
    knee : float
        Radians from which on a crease has its full effect: a facet of a curved moulding is no smoother than a corner.
    thin : float
        A triangle of less height, relative to its longest edge, has no reliable normal: an edge with it shows no bend.
    most_error : float
        Relative standard error of the irradiance right at a crease. Living room, white panelling: 0.25 to 0.4 there and
        0.07 to 0.12 on flat parts.
    """

    reach: float = 1.5
    knee: float = 0.1
    thin: float = 1e-3
    most_error: float = 0.3


CREASES = CreaseParams()


@dataclass(frozen=True)
class SurfaceParams:
    """How the surface is laid out in texels, and its parts are told apart.

    Attributes
    ----------
    expected_fill : float
        Share of the atlas that islands usually cover; only the unwrapping's margin depends on it.
    step : int
        Edges of atlases and pages are multiples of it.
    page_shapes : tuple of float
        Widths that are tried for a block of islands, of the edge of the square that would hold their area.
    turned : float
        Metres: so far apart count two elements whose normals differ by a radian (`Atlas.place`).
    weld : float
        Share of the room's diagonal within which vertices are one: at seams and between triangles they are listed
        twice.
    tiny : float
        A part of less than this share of the surface is a crumb of a scan, no object.
    overlap_texels : float
        Triangles may penetrate each other by this much; far less than what moves a texel's centre, more than rounding.
    margin : int
        Texels between two charts: half of them on either side show the chart, too, for what lies between texels.
    full, hopeless : float
        Islands that fill less of their rectangle are cut in two, or all apart where a cut gains nothing.
    rounds : int
        Such cuts in a row.
    """

    expected_fill: float = 0.55
    step: int = 64
    page_shapes: tuple[float, ...] = (1.0, 1.1, 1.25, 1.5)
    turned: float = 0.2
    weld: float = 1e-6
    tiny: float = 1e-3
    overlap_texels: float = 0.02
    margin: int = 2
    full: float = 0.6
    hopeless: float = 0.25
    rounds: int = 10


SURFACE = SurfaceParams()


@dataclass(frozen=True)
class PartsParams:
    """How a mesh is taken apart by its shape (`shape_parts`); shares and angles, so no unit of length counts.

    Over three rooms fused from depth the share of the surface in the right part moves by less than .02 for half or
    double of each of `SURFACE.tiny`, `smooth` and `concave`.

    Attributes
    ----------
    rounds, crease : int, float
        Of the bilateral filter of normals, and its standard deviation in radians.
    directions : int
        In which planes are looked for, 6 degrees apart.
    gap : float
        Diagonals of the mesh's box that a plane's triangles lie off it: 4 cm in a room.
    tilt : float
        Radians by which their filtered normals differ from it.
    plane, seed : float
        Least share of the surface in a plane, and of that in the cell where it is looked for.
    small : float
        Least share of the surface in a plane that is no part by itself and only closed: an armchair's side.
    fits : int
        Rounds of least squares of a plane.
    smooth : float
        Radians of the bend below which two triangles are of one piece.
    concave : float
        Radians of the mean bend from which on an edge parts two things.
    outer : float
        Share of the surface, and of the viewpoints, in front of a floor, a ceiling, a wall.
    """

    rounds: int = 8
    crease: float = float(np.radians(20))
    directions: int = 1000
    gap: float = 0.006
    tilt: float = float(np.radians(25))
    plane: float = 0.006
    small: float = 0.0015
    seed: float = 0.05
    fits: int = 3
    smooth: float = float(np.radians(15))
    concave: float = float(np.radians(20))
    outer: float = 0.85


PARTS = PartsParams()


@dataclass(frozen=True)
class SparseParams:
    """Where one element stands for many texels, and triangles take few (`seen_cells`, `sparse_layout`).

    Attributes
    ----------
    cell : int
        Edge of a cell in elements. In those that a ray met, and the ones beside them, lies 99.7 % of what a kitchen's
        frames observed three times and more; together they hold 1.2 times the elements that were observed.
    coarse : int
        Edge in elements of the cells that stand for what no frame saw. With 8 the light beside a ceiling lamp that no
        frame sees came out wrong, and the lamp at .68 of its radiance; with 2 at .93, without such cells at .90.
    far : int
        The same of what belongs to another part of a building: a sixteenth of the elements.
    block : int
        Edge in texels of what shows one element: between the centres of four texels a lookup stays within them.
    angle : float
        Radians: what no frame saw takes cells of this edge, seen from the cameras, where that is larger.
    fine : float
        Elements along its longest edge: smaller triangles that were seen have a cell as large as an element. In a
        kitchen of a million triangles that is half of them, and 0.3 % of the surface; to unwrap them took 600 MiB.
    large : int
        Texels along the root of a triangle's area: one that no frame saw takes no more, however large it is, and only
        larger ones are tested for the share of them that was seen.
    seen_part : float
        A large triangle takes at most so many times the texels of what was seen of it, to a factor of 4.
    outer : float
        Share of the elements at either end of an axis: between them is the room's middle (`atlas.room_box`).
    highest : float
        Of the atlas's edge sparse triangles take at most this: else their texels grow.
    """

    cell: int = 8
    coarse: int = 2
    far: int = 4
    block: int = 2
    angle: float = 0.02
    fine: float = 0.5
    large: int = 64
    seen_part: float = 16
    outer: float = 0.15
    highest: float = 0.25


SPARSE = SparseParams()


@dataclass(frozen=True)
class ClosingParams:
    """What of a fused mesh's holes frames see past the room in (`closing`).

    In the rooms looked at the outside is clipped in more than half of its observations, or brighter than nearly all of
    the room; what was not fused is neither.

    Attributes
    ----------
    block : int
        Edge in cells of the squares that close what no frame saw, a power of 2: a third of a metre in a room.
    fine : int
        Parts of a cell's edge: a cell is closed of which one is open, 0.8 cm in a room. With 4 a kitchen by phone shows
        234 specks of nothing in twelve views, with 8 and 16 55 and 50.
    speck : int
        Connected cells, of 4 cm in a room: no window is so small, and a hole that is shows black.
    rectangle : float
        Of the cells of a plane's rectangle that have mesh or are seen past, this share has mesh at least where the
        others are closed. In seven rooms by phone most planes of furniture have .94 to 1, a glazed wall .8.
    under : float
        Cells that a face lies at least under the scan's denoised border, as the two cover each other: 1 mm in a room.
    """

    block: int = 8
    fine: int = 8
    speck: int = 4
    rectangle: float = 0.9
    under: float = 0.025


CLOSING = ClosingParams()


@dataclass(frozen=True)
class DivisionParams:
    """How a building is divided into parts (`division`).

    Attributes
    ----------
    large : float
        Share of a part's cells: an object with more of them may lie in several parts.
    off : float
        A part may have this share of its cells less or more, so that planes cut what is empty.
    planes : int
        The widest gaps between cells that a plane is tried in.
    rays : int
        From each part's surface, to find what sends light into it.
    least : float
        Share of them that meets what is taken; and that may meet what too few frames see. Rays that slip through a
        closed room's edges are fewer. With 1e-2 for the latter a room lit through a door had 12 % too little light.
    looks : float
        Share of its pixels with which a frame looks at a part, from which on the part takes it.
    views : int
        Frames that what sends light into a part is seen by: a median of fewer keeps highlights.
    base, each : float
        Bytes that a recovery takes, and for each element that is counted. Of captures with 1 to 8.2 M elements .9 to
        3.8 GB, 400 bytes each; the cells beside those that are met hold half as many elements more.
    """

    large: float = 0.25
    off: float = 0.25
    planes: int = 65
    rays: int = 1 << 20
    least: float = 1e-4
    looks: float = 0.1
    views: int = 3
    base: float = 6e8
    each: float = 600.0


DIVISION = DivisionParams()
