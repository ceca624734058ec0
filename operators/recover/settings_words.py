"""The settings in an artist's words: labels with units, tooltips, and what each choice means.

The command line's help is the `Settings` docstring; a setting that is not listed here is told in those words.
"""

from typing import NamedTuple

from ...addon.settings_info import SettingInfo


class Words(NamedTuple):
    """Label and tooltip of a setting; label and tooltip of each of its choices."""

    label: str
    text: str
    choices: dict[str, tuple[str, str]] = {}


WORDS = {
    "texel_size": Words("Texel Size (m)", "Edge of a texel in metres; 0 takes what the frames resolve"),
    "detail": Words(
        "Detail", "Texels along one pixel of the frames, where the texel size is 0; more is finer and slower"
    ),
    "atlas_size": Words("Largest Texture (px)", "The longest edge that a texture may have, in pixels"),
    "atlas": Words(
        "Textures",
        "How many images the colours of the room are in",
        {
            "room": ("One for the Room", "One image for all objects"),
            "object": ("One an Object", "One image for each object, as fine as the frames show it: for close work"),
            "udim": (
                "UDIM Tiles",
                "Numbered tiles of the largest texture size, as fine as the frames show each object",
            ),
        },
    ),
    "denoise_mesh": Words(
        "Smooth the Mesh",
        "Take the noise out of a scanned mesh and keep its edges; a mesh without "
        "noise and your own objects stay as they are",
    ),
    "refine_poses": Words(
        "Correct Cameras",
        "Move frames that lie beside what all of them show together; good ones, "
        "and the cameras of your own scene, stay as they are",
    ),
    "median": Words(
        "Average",
        "How the frames' views of a spot become one colour",
        {
            "exact": ("Exact", "The exact median; every view goes to the disk meanwhile"),
            "p2": ("Estimated", "A running estimate of the median, as in the paper"),
            "mean": ("Mean", "The plain mean; lets highlights and passers-by in"),
        },
    ),
    "sharpen": Words(
        "Sharpen", "Give the texture back the detail that averaging has blurred; reads the frames once more"
    ),
    "shading": Words(
        "Light Rays",
        "Where rays go that look for light",
        {
            "aimed": ("To the Lamps Too", "Everywhere, and besides to what is bright: less noise"),
            "uniform": ("Everywhere Alike", "In all directions alike, as in the paper; noisy"),
        },
    ),
    "shading_rays": Words("Rays", "Rays that look for light, from each spot; more is calmer and slower"),
    "emitter_rays": Words("Rays to Lamps", "Rays to bright surfaces from each texel, where rays go to the lamps too"),
    "portal_rays": Words(
        "Rays to Openings", "Rays to windows and doors from each spot, where rays go to the lamps too"
    ),
    "interpolate": Words(
        "Skip Even Light",
        "Look for indirect light where it changes and fill in between; without it "
        "every texel is looked from, which takes long",
    ),
    "mirrors": Words(
        "Find Mirrors", "Find flat mirrors and follow light over them; without it a mirror counts as a painted picture"
    ),
    "specular": Words(
        "Highlights From",
        "What roughness and specular are fitted to",
        {
            "frames": ("Several Frames", "Several frames of each object at once"),
            "target": ("One Frame", "The one frame that shows the highlight best, as in the paper"),
        },
    ),
    "specular_rays": Words("Rays", "Rays for each view in the fit of the highlights; more is calmer and slower"),
    "refine": Words(
        "Rounds After",
        "0 stops after the first fit; 1 takes the highlights out of the texture; 2 lights "
        "the room with what glossy things reflect, too",
    ),
    "texture_fill": Words(
        "Texture the Unseen",
        "Give what no frame saw the texture of its plane's measured part; without it such a part has one even colour",
    ),
    "threads": Words("Threads", "Processor threads that the run takes; 0 takes all"),
    "seed": Words("Seed", "Another number gives other noise; the same one gives the same result again"),
}


def words(info: SettingInfo) -> Words:
    """What the interface calls a setting."""
    found = WORDS.get(info.name) or Words(info.name.replace("_", " ").title(), info.help)
    choices = {
        name: found.choices.get(name, (name.replace("_", " ").title(), f"Take '{name}'")) for name in info.choices
    }
    return found._replace(choices=choices)
