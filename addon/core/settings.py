"""Every setting of a run, in one frozen value. The command line, the operators and the panel all fill this in."""

from dataclasses import dataclass, fields

from .errors import BadInputError

ROOM = "room"


@dataclass(frozen=True)
class Settings:
    """Settings of `recover`; `PRESETS` holds the ones that have names.

    What an attribute says below is the command line's help; its first sentence is the tooltip in Blender.

    Attributes
    ----------
    texel_size : float
        Edge of a texel in metres; 0 takes what the frames resolve.
    detail : float
        Texels along one pixel of the frames, where the texel size is 0; more is finer and slower.
    atlas_size : int
        The longest edge that a texture may have, in pixels.
    atlas : str
        How many images the colours of the room are in. 'room' (one for the room), or for close work 'object' (one for
        each object, as fine as the frames resolve it) or 'udim' (the same as tiles of at most atlas_size); the room's
        images are written all the same.
    denoise_mesh : bool
        Take the noise out of a scanned mesh and keep its edges; a mesh without noise and your own objects stay as they
        are.
    refine_poses : bool
        Move frames that lie beside what all of them show together; good ones, and the cameras of your own scene, stay
        as they are.
    median : str
        How the frames' views of a spot become one colour. 'exact' (all observations go to disk meanwhile, 16 bytes
        each), 'p2' (as in the paper: P-square over all observations, in the order of the video) or 'mean'.
    sharpen : bool
        Give the texture back the detail that averaging has blurred; reads the frames once more.
    shading : str
        Where rays go that look for light. 'aimed' (cosine rays, and rays aimed at bright triangles) or 'uniform' (as in
        the paper: uniform rays at each surface element, no other light than what frames saw, albedo as the quotient has
        it).
    shading_rays : int
        Rays that look for light, from each spot; more is calmer and slower.
    emitter_rays : int
        Rays to bright surfaces from each texel, where rays go to the lamps too. That is with 'aimed' only.
    portal_rays : int
        Rays to windows and doors from each spot, where rays go to the lamps too. That is with 'aimed' only.
    interpolate : bool
        Look for indirect light where it changes and fill in between; without it every texel is looked from, which takes
        long.
    mirrors : bool
        Find flat mirrors and follow light over them; without it a mirror counts as a painted picture.
    specular : str
        What roughness and specular are fitted to. 'frames' (several frames at once, and a choice of model) or 'target'
        (as in the paper: a lobe for each object, from one target frame).
    specular_rays : int
        Rays for each view in the fit of the highlights; more is calmer and slower.
    refine : int
        0 stops after the first fit; 1 takes the highlights out of the texture; 2 lights the room with what glossy
        things reflect, too.
    threads : int
        Processor threads that the run takes; 0 takes all.
    seed : int
        Another number gives other noise; the same one gives the same result again.
    texture_fill : bool
        Give what no frame saw the texture of its plane's measured part; without it such a part has one even colour.
    without : tuple of str
        Passes that are left out, by name (`passes.registry`); what each gains: docs/ablation.md.
    """

    texel_size: float = 0.0
    detail: float = 1.0
    atlas_size: int = 4096
    atlas: str = ROOM
    denoise_mesh: bool = True
    refine_poses: bool = True
    median: str = "exact"
    sharpen: bool = True
    shading: str = "aimed"
    shading_rays: int = 128
    emitter_rays: int = 32
    portal_rays: int = 32
    interpolate: bool = True
    mirrors: bool = True
    specular: str = "frames"
    specular_rays: int = 128
    refine: int = 2
    texture_fill: bool = True
    threads: int = 0
    seed: int = 0
    without: tuple[str, ...] = ()

    CHOICES = {
        "atlas": (ROOM, "object", "udim"),
        "median": ("exact", "p2", "mean"),
        "shading": ("aimed", "uniform"),
        "specular": ("frames", "target"),
    }

    def __post_init__(self):
        object.__setattr__(self, "without", tuple(self.without))  # JSON has lists
        for name, allowed in self.CHOICES.items():
            if getattr(self, name) not in allowed:
                raise BadInputError(f"Setting '{name}' is '{getattr(self, name)}'; choose one of {', '.join(allowed)}.")
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, (int, float)) and not isinstance(value, bool) and not 0 <= value < float("inf"):
                raise BadInputError(f"Setting '{field.name}' is {value}; give a finite number of at least 0.")
        if not self.detail > 0:
            raise BadInputError(f"Setting 'detail' is {self.detail}; give more than 0.")
        if self.shading_rays < 1 or self.specular_rays < 1 or self.atlas_size < 64:
            raise BadInputError("Settings shading_rays and specular_rays must be at least 1, atlas_size at least 64.")

    @property
    def published(self) -> frozenset[str]:
        """The stages that are done as in the paper, and by nothing else."""
        chosen = {"lit_diffuse": self.median == "p2", "shading": self.shading == "uniform",
                  "specular": self.specular == "target"}  # fmt: skip
        return frozenset(stage for stage, wanted in chosen.items() if wanted)


PAPER = Settings(
    denoise_mesh=False,
    refine_poses=False,
    median="p2",
    sharpen=False,
    shading="uniform",
    shading_rays=10000,
    emitter_rays=0,
    portal_rays=0,
    interpolate=False,
    mirrors=False,
    specular="target",
    specular_rays=10000,
    refine=0,
    texture_fill=False,
)
"""Haefner et al. 2021 and nothing else: `paper/`."""
DRAFT = Settings(detail=0.5, sharpen=False, shading_rays=48, emitter_rays=16, portal_rays=16, specular_rays=96)
"""A first look: texels of two pixels' edge, few rays."""
FINE = Settings(detail=1.5, shading_rays=384, emitter_rays=64, portal_rays=96, specular_rays=512)
"""What more time buys."""
PRESETS = {"draft": DRAFT, "normal": Settings(), "fine": FINE, "paper": PAPER}
"""By the names that the interfaces show."""
