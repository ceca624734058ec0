"""Keys of the artist's choice: entries of the 3D view without a key, to be given one in the preferences."""

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
    """Add the entries, without keys; there is no keyboard in the background."""
    known = bpy.context.window_manager.keyconfigs.addon
    if known is None:
        return
    keymap = known.keymaps.new(name=MAP, space_type="VIEW_3D")
    for operator, properties in ENTRIES:
        item = keymap.keymap_items.new(operator, type="NONE", value="PRESS")
        for name, value in properties.items():
            setattr(item.properties, name, value)
        _added.append((keymap, item))


def unregister() -> None:
    """Take them back."""
    for keymap, item in _added:
        keymap.keymap_items.remove(item)
    _added.clear()


def draw(layout, context) -> None:
    """The entries as the artist has set them, in the preferences."""
    known = context.window_manager.keyconfigs.user
    keymap = known.keymaps.get(MAP) if known is not None else None
    if keymap is None:
        return
    import rna_keymap_ui

    header, body = layout.panel("scan_relight_keys", default_closed=True)
    header.label(text="Keys in the 3D View")
    if body is None:
        return
    body.use_property_split = body.use_property_decorate = False
    left = list(zip(ENTRIES, LABELS, strict=True))
    for item in keymap.keymap_items:
        for entry in left:
            (operator, properties), label = entry
            given = {name: getattr(item.properties, name, None) for name in properties}
            if (operator, properties) == (item.idname, given):
                left.remove(entry)
                body.label(text=label)
                rna_keymap_ui.draw_kmi([], known, keymap, item, body, 0)
                break
