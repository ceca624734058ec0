"""Blender's properties for operators and property groups, each with its label and tooltip first."""

from functools import partial

import bpy


def _property(kind, name: str, description: str, **kwargs):
    return kind(name=name, description=description, **kwargs)


bool_property = partial(_property, bpy.props.BoolProperty)
int_property = partial(_property, bpy.props.IntProperty)
float_property = partial(_property, bpy.props.FloatProperty)
vector_property = partial(_property, bpy.props.FloatVectorProperty, size=3)
string_property = partial(_property, bpy.props.StringProperty)
"""Label, tooltip, and the other arguments of Blender's property; a vector has three elements."""


def enum_property(name: str, description: str, items, **kwargs):
    """A choice of `items`: a sequence, or a function that gives one."""
    return bpy.props.EnumProperty(name=name, description=description, items=items, **kwargs)


def _path(subtype: str, name: str, description: str, *options: str, **kwargs):
    return string_property(name, description, subtype=subtype, options=set(options), **kwargs)


folder_property, file_property = partial(_path, "DIR_PATH"), partial(_path, "FILE_PATH")
"""Properties for a path: label, tooltip, options, and other arguments of `StringProperty`."""
FOLDERS = bool_property("Folders", "Only folders are shown", default=True, options={"HIDDEN", "SKIP_SAVE"})
"""Property that makes the file browser show folders only."""
