"""The processor or graphics card that Cycles renders on: named in this Blender, used in another.

A process of its own starts with factory settings, so what the artist's preferences say has to be handed over in words.
"""

import bpy

from ..core.errors import BadInputError

CPU, GPU = "CPU", "GPU"
TYPES = ("OPTIX", "CUDA", "HIP", "METAL", "ONEAPI")
"""Cycles' kinds of graphics card, the quicker one first where a card is of two kinds."""


def current_device(scene: bpy.types.Scene) -> str:
    """The device that this scene renders on here, for `use_device`: 'CPU', or a kind and the cards' ids."""
    preferences = preferences_of_cycles()
    if preferences is None or scene.cycles.device != "GPU" or preferences.compute_device_type == "NONE":
        return CPU
    kind = preferences.compute_device_type
    used = [device.id for device in preferences.devices if device.use and device.type in (kind, "CPU")]
    return f"{kind}={'|'.join(used)}" if used else CPU


def use_device(scene: bpy.types.Scene, device: str) -> str:
    """Have a scene rendered on a device, on the processor where it is not to be had.

    Parameters
    ----------
    device : str
        'CPU'; 'GPU', which is all graphics cards of the first kind of `TYPES` that there is; one of `TYPES`; or what
        `current_device` gave. Whatever the case, but for ids. Raises `BadInputError`: there is no such kind.

    Returns
    -------
    str
        '' or a remark: why it is the processor.
    """
    kind, _, ids = device.partition("=")
    kind, device_ids = kind.strip().upper(), {card for card in ids.split("|") if card}
    if kind not in (CPU, GPU, *TYPES):
        raise BadInputError(f"There is no device '{device}'; take cpu, gpu or one of {', '.join(TYPES).lower()}.")
    scene.cycles.device = "CPU"
    if kind == CPU:
        return ""
    for device_type in TYPES if kind == GPU else (kind,):
        if _enable(device_type, device_ids):
            scene.cycles.device = "GPU"
            return ""
    what = "such graphics card" if kind == GPU else f"{kind} device"
    return f"Blender finds no {what} here, so the processor renders."


def preferences_of_cycles():
    """Cycles' preferences of this Blender; None where the add-on is off."""
    addon = bpy.context.preferences.addons.get("cycles")
    return addon.preferences if addon else None


def _enable(kind: str, device_ids: set[str]) -> bool:
    """Switch on the devices of a kind, those of `device_ids` alone if there are any; whether there is one."""
    preferences = preferences_of_cycles()
    if preferences is None:
        return False
    previous = preferences.compute_device_type
    try:
        preferences.compute_device_type = kind
    except TypeError:  # this Blender was built without it
        return False
    preferences.refresh_devices()
    cards = [device for device in preferences.devices if device.type == kind]
    chosen = [device for device in cards if device.id in device_ids] or cards
    for device in preferences.devices:
        device.use = device in chosen or device.id in device_ids
    if not chosen:
        preferences.compute_device_type = previous
    return bool(chosen)
