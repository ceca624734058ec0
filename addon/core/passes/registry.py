"""The passes that correct the published method, by name: what each does, and the first stage that it changes.

Any of them can be left out (`Settings.without`); what each gains: docs/ablation.md. Those of other packages follow the
stage's own. They are made known by `register`, or found by their entry points:

    [project.entry-points."scan_relight.passes"]
    grey-floor = "my_package.grey_floor:PASS"
"""

import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import entry_points
from typing import Any, TypeVar

from ..errors import BadInputError, ScanRelightError
from ..origin import package_of, package_of_entry_point
from ..stages import RUN_STAGES

GROUP = "scan_relight.passes"
OPEN_STAGES = ("lit_diffuse", "shading", "specular")
"""Stages that a pass of another package can follow. The surface is stored as what it differs by from the capture's."""
T = TypeVar("T")


@dataclass(frozen=True)
class Pass:
    """One pass.

    Attributes
    ----------
    does : str
        One sentence.
    stage : str
        The first stage whose result it changes, of `stages.RUN_STAGES`.
    run : callable(value, before) -> value, optional
        Of another package's: the stage's value to a new one of the same type, once the stage's own passes are through.
        `before` has the values of the stages before it, by name. The program's own are called where they belong.
    origin : str
        Of another package's: its name and version.
    """

    name: str
    does: str
    stage: str
    run: Callable[[Any, Mapping[str, Any]], Any] | None = None
    origin: str = ""


def _passes_of(stage: str, **does: str) -> tuple[Pass, ...]:
    return tuple(Pass(name.replace("_", "-"), sentence, stage) for name, sentence in does.items())


PASSES = (
    *_passes_of(
        "surface",
        frame_choice="Passes over frames that show nothing which others don't show from as near.",
        close_holes="Closes holes of a mesh without objects in its large planes, where frames see nothing there.",
        mesh_denoising="Takes a scan's noise out of its vertices.",
        sheets="Puts what lies in flat parts into their planes.",
        coarse_unseen="Lets one element stand for many texels where no frame looks.",
        two_sides="Gives triangles that frames see from both sides a second side of its own.",
    ),
    *_passes_of(
        "lit_diffuse",
        radiometric_calibration="Tells what codes mean, and exposures, by places that several frames show.",
        white_balance="Tells the white balance that all frames have, by how a camera follows what it sees.",
        pose_refinement="Puts frames right that lie beside what all of them show together.",
        sharpening="Takes the projection's blur out of the lit diffuse texture.",
        edge_tier="Uses observations at depth edges only where there are too few others.",
    ),
    *_passes_of(
        "shading",
        clipped_lamps="Solves for lamps that the sensor clipped, from the light that they send.",
        clipped_patches="Takes what nearly all frames clip, or is far brighter than a room without objects, as lamps.",
        unseen_lamps="Solves for lamps that no frame sees.",
        unseen_sky="Solves for the parts of the sky that no frame sees.",
        whole_sky="Solves for the sky where no frame sees any of it.",
        plausible_light="Solves once more, together, for lamps and skies where frames clip some, by plausible albedo.",
        missing_light="Solves for clipped patches, and for what comes in by openings of a mesh without objects.",
        sun="Solves for a sun that no frame sees from the patch of light that it makes.",
        clipped_sunlight="Lets a patch of sun that frames clip send what the albedo around it makes of the sun.",
        seen_sun="Takes a sun that frames see out of the environment map and treats it by itself.",
        material_parts="Sets apart connected pieces of an object that look unlike the rest of it.",
        mirrors="Finds flat mirrors and follows light over them.",
        emitter_rays="Aims rays at bright triangles.",
        portal_rays="Aims rays at the openings to the outside.",
        interpolation="Gathers irradiance at few points and interpolates between them.",
        lamp_noise="Takes the noise of rays and of interpolation out of the irradiance.",
        crease_error="Counts irradiance beside creases as less certain.",
        unseen_surfaces="Lets what no frame sees reflect like the rest of its object.",
    ),
    *_passes_of(
        "specular",
        grazing="Lets the diffuse part darken towards grazing views.",
        pixel_curvature="Widens lobes by how the surface turns within a pixel, and fits them where it turns little.",
        highlight_sampling="Looks for a lobe once more where highlights are expected.",
        ray_noise="Takes the rays' noise out of the least squares for the lobe.",
        dielectric_prior="Gives the specular weight of dielectrics a prior.",
        see_through="Sets apart what is transparent or cut out.",
        metal_by_looks="Tells metals of one colour from all of their surface.",
        coat_by_looks="Tells coated things of one colour from all of their surface.",
        class_lobes="Shares lobes among objects of one class.",
        unlit_lamps="Has windows and screens dark with their light off, and bright pieces of walls as their walls.",
        specular_removal="Takes the fitted specular part out of every observation, and the median of what is left.",
        glossy_light="Lights the room by what glossy things really reflect.",
        sun_strength="Solves again for a sun's irradiance, once the specular part of the lit diffuse texture is known.",
        caustics="Follows light from bright triangles over glossy things by photons.",
    ),
    *_passes_of(
        "write",
        bias_field="Takes the smooth error that irradiance leaves in an object's albedo out of it.",
        albedo_prior="Shrinks uncertain albedo towards its neighbourhood's.",
        second_colour="Shrinks it to a second colour of the neighbourhood where that is likelier.",
        wide_prior="Widens the neighbourhood for as long as it stays alike.",
        object_spread="Takes the spread of single observations from others of the object.",
        texture_fill="Gives what is filled in the texture of its plane's measured part.",
        compensation="Raises Base Color for the light that the Principled coat keeps from the diffuse part.",
    ),
)  # fmt: skip
"""All of them in the order of the stages."""
_built_in = {pass_.name: pass_ for pass_ in PASSES}
_registered: dict[str, Pass] = {}


def register(pass_: Pass) -> Pass:
    """Have a pass of another package called at the end of its stage, after those that were registered before.

    Raises
    ------
    BadInputError
        There is a pass of that name already, or it has no stage or function that it could have.
    """
    if pass_.name in _built_in or _registered.get(pass_.name, pass_) is not pass_:
        raise BadInputError(f"There is a pass '{pass_.name}' already; give the new one another name.")
    if pass_.stage not in OPEN_STAGES or pass_.run is None:
        raise BadInputError(
            f"The pass '{pass_.name}' needs a function, and one of the stages {', '.join(OPEN_STAGES)}."
        )
    _registered[pass_.name] = pass_
    return pass_


def passes() -> tuple[Pass, ...]:
    """All of them, the program's own first."""
    _register_installed()
    return (*PASSES, *_registered.values())


def stage_of(name: str) -> str:
    """The first stage that a pass changes. Raises `KeyError` where there is no such pass."""
    return _built_in[name].stage if name in _built_in else {pass_.name: pass_.stage for pass_ in passes()}[name]


def check(without: Collection[str]) -> None:
    """Raise `BadInputError` for a name that is no pass's."""
    known = [pass_.name for pass_ in passes()]
    for name in without:
        if name not in known:
            raise BadInputError(f"There is no pass '{name}' to leave out; choose among {', '.join(known)}.")


def left_out_of(stage: str, without: Collection[str]) -> tuple[str, ...]:
    """Those of the program's own passes left out that change `stage` first: a part of its key."""
    assert stage in RUN_STAGES
    return tuple(name for name in sorted(without) if name in _built_in and _built_in[name].stage == stage)


def following(stage: str, without: Collection[str]) -> tuple[Pass, ...]:
    """Other packages' passes that follow a stage, in the order in which they are called."""
    return tuple(pass_ for pass_ in passes()[len(PASSES) :] if pass_.stage == stage and pass_.name not in without)


def followed(stage: str, value: T, before: Mapping[str, Any], without: Collection[str]) -> T:
    """A stage's value after other packages' passes.

    Raises
    ------
    ScanRelightError
        One of them failed, or gave something else.
    """
    for pass_ in following(stage, without):
        assert pass_.run is not None
        subject = f"The pass '{pass_.name}' of '{pass_.origin or package_of(pass_.run)}'"
        try:
            result = pass_.run(value, before)
        except ScanRelightError:
            raise
        except Exception as error:  # whatever another package does wrong
            raise ScanRelightError(f"{subject} failed ({error!r}); mend it, or leave it out.") from error
        if type(result) is not type(value):
            raise ScanRelightError(
                f"{subject} gave a {type(result).__name__}, no {type(value).__name__}; mend it, or leave it out."
            )
        value = result
    return value


@cache
def _register_installed() -> None:
    """Register, once, what installed packages bring; one that is broken is left out with a warning."""
    for entry in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        try:
            register(replace(entry.load(), origin=package_of_entry_point(entry)))
        except Exception as error:  # whatever another package does wrong
            warnings.warn(f"The pass '{entry.name}' can't be loaded ({error!r}); mend it.", stacklevel=2)
