"""Keymap items of the 3D view without a key, to be assigned one in the preferences."""

import bpy

ENTRIES = (
    ("scan_relight.run", {"target": "recover"}),
    ("scan_relight.stop", {}),
    ("scan_relight.before_after", {}),
    ("scan_relight.match_frame", {"step": 1}),
    ("scan_relight.match_frame", {"step": -1}),
)
"""Operator and properties: run, stop, before and after, next frame, previous frame."""
LABELS = ("Run", "Stop", "Before and After", "Next Frame", "Previous Frame")
MAP = "3D View"

_added: list[tuple] = []


def register() -> None:
    """Add the items, without keys; in the background there is no key configuration."""
    keyconfig = bpy.context.window_manager.keyconfigs.addon
    if keyconfig is None:
        return
    keymap = keyconfig.keymaps.new(name=MAP, space_type="VIEW_3D")
    for operator, properties in ENTRIES:
        item = keymap.keymap_items.new(operator, type="NONE", value="PRESS")
        for name, value in properties.items():
            setattr(item.properties, name, value)
        _added.append((keymap, item))


def unregister() -> None:
    """Remove them."""
    for keymap, item in _added:
        keymap.keymap_items.remove(item)
    _added.clear()


def draw(layout, context) -> None:
    """Draw the items as the artist has set them, in the preferences."""
    keyconfig = context.window_manager.keyconfigs.user
    keymap = keyconfig.keymaps.get(MAP) if keyconfig is not None else None
    if keymap is None:
        return
    import rna_keymap_ui

    header, body = layout.panel("scan_relight_keys", default_closed=True)
    header.label(text="Keys in the 3D View")
    if body is None:
        return
    body.use_property_split = body.use_property_decorate = False
    unmatched = list(zip(ENTRIES, LABELS, strict=True))
    for item in keymap.keymap_items:
        for entry in unmatched:
            (operator, properties), label = entry
            item_properties = {name: getattr(item.properties, name, None) for name in properties}
            if (operator, properties) == (item.idname, item_properties):
                unmatched.remove(entry)
                body.label(text=label)
                rna_keymap_ui.draw_kmi([], keyconfig, keymap, item, body, 0)
                break
