"""Labels of the settings and their choices in the interface; the docstring of `Settings` describes what each does."""

from ...addon.settings_info import SettingInfo

LABELS = {
    "texel_size": "Texel Size (m)",
    "atlas_size": "Largest Texture (px)",
    "atlas": "Textures",
    "denoise_mesh": "Smooth the Mesh",
    "refine_poses": "Correct Cameras",
    "median": "Average",
    "shading": "Light Rays",
    "shading_rays": "Rays",
    "emitter_rays": "Rays to Lamps",
    "portal_rays": "Rays to Openings",
    "interpolate": "Skip Even Light",
    "mirrors": "Find Mirrors",
    "specular": "Highlights From",
    "specular_rays": "Rays",
    "refine": "Rounds After",
    "texture_fill": "Texture the Unseen",
}
"""Of settings whose name makes no good label."""
CHOICES = {
    "atlas": {
        "room": ("One for the Room", "One image for all objects"),
        "object": ("One an Object", "One image for each object, as fine as the frames show it: for close work"),
        "udim": ("UDIM Tiles", "Numbered tiles of the largest texture size, as fine as the frames show each object"),
    },
    "median": {
        "exact": ("Exact", "The exact median; every view goes to the disk meanwhile"),
        "p2": ("Estimated", "A running estimate of the median, as in the paper"),
        "mean": ("Mean", "The plain mean; lets highlights and passers-by in"),
    },
    "shading": {
        "aimed": ("To the Lamps Too", "Everywhere, and besides to what is bright: less noise"),
        "uniform": ("Everywhere Alike", "In all directions alike, as in the paper; noisy"),
    },
    "specular": {
        "frames": ("Several Frames", "Several frames of each object at once"),
        "target": ("One Frame", "The one frame that shows the highlight best, as in the paper"),
    },
}


def words(info: SettingInfo) -> tuple[str, str, dict[str, tuple[str, str]]]:
    """Label and tooltip of a setting; label and tooltip of each of its choices."""
    choices = CHOICES.get(info.name, {})
    choices = {name: choices.get(name, (_title(name), f"Take '{name}'")) for name in info.choices}
    return LABELS.get(info.name, _title(info.name)), info.help.partition(". ")[0], choices


def _title(name: str) -> str:
    return name.replace("_", " ").title()
