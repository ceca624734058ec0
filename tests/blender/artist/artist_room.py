"""A small room as an artist would have it: n-gons, modifiers, instances, mirrored and shared meshes, old materials."""

import importlib
import math

import bpy
import numpy as np

from addon.core.io.exr import write_exr

SIZE = (48, 36)


def bridge(name):
    """A module of the registered package's bridge."""
    return importlib.import_module(f"scan_relight.addon.bridge.{name}")


def mesh_object(name, vertices, faces, materials=(), uv="UVMap"):
    """A mesh object in the open scene; its faces take the materials in turn."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    for material in materials:
        data.materials.append(material)
    if materials:
        data.polygons.foreach_set("material_index", np.arange(len(faces), dtype=np.int32) % len(materials))
    if uv:
        layer = data.uv_layers.new(name=uv)
        layer.uv.foreach_set("vector", np.random.default_rng(len(faces)).random(2 * len(data.loops), np.float32))
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def box(low, high, inwards=False):
    """Vertices and quads of a box."""
    corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, [face[::-1] for face in faces] if inwards else faces


def paint(name, color=(0.5, 0.5, 0.5)):
    """A plain material."""
    made = bpy.data.materials.new(name)
    if made.node_tree is None:
        made.use_nodes = True
    made.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1)
    return made


def build_room():
    """The room; objects by name. Everything that is to be captured is selected."""
    red, green, grey = paint("red", (0.7, 0.1, 0.1)), paint("green", (0.1, 0.6, 0.2)), paint("grey")
    things = {"room": mesh_object("room", *box((-2, -1.5, 0), (2, 1.5, 2.5), True), [grey])}
    # A table of five corners, dented: no triangulation but Blender's own is right.
    top = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0.5, 0.4, 0), (0, 1, 0)]
    things["table"] = mesh_object(
        "table",
        top + [(x, y, -0.5) for x, y, _ in top],
        [(0, 1, 2, 3, 4), (9, 8, 7, 6, 5), *((i, i + 5, (i + 1) % 5 + 5, (i + 1) % 5) for i in range(5))],
        [red, green, None],
    )
    things["table"].location = (-1.5, -1, 0.8)
    things["mirrored"] = mesh_object("mirrored", *box((0, 0, 0), (0.4, 0.5, 0.6)), [green])
    things["mirrored"].scale, things["mirrored"].location = (-1, 1.5, 1), (1.6, 0.4, 0.01)
    chair = mesh_object("chair", *box((0, 0, 0), (0.3, 0.3, 0.5)), [red])
    things["chair"] = chair
    chair.location = (0.4, -1.2, 0.02)
    second = things["chair.001"] = bpy.data.objects.new("chair.001", chair.data)
    second.location, second.rotation_euler = (1.2, -1.1, 0.02), (0, 0, 0.7)
    bpy.context.scene.collection.objects.link(second)
    bare = things["bare"] = mesh_object("bare", *box((0, 0, 0), (0.3, 0.2, 0.3)), uv=None)
    bare.location = (0.2, 0.9, 0.02)
    things["bent"] = mesh_object("bent", *box((0, 0, 0), (0.2, 0.2, 0.4)), [grey])
    things["bent"].location = (-0.8, 0.9, 0.02)
    bend = things["bent"].modifiers.new("bend", "SIMPLE_DEFORM")
    bend.deform_method, bend.angle = "TWIST", 0.4
    round_ = things["round"] = mesh_object("round", *box((0, 0, 0), (0.4, 0.4, 0.4)), [green])
    round_.location = (-1.6, 0.8, 0.02)
    round_.modifiers.new("round", "SUBSURF").levels = 1
    group = bpy.data.collections.new("shelf")
    for k in range(2):
        board = mesh_object(f"board {k}", *box((0, 0, 0), (0.6, 0.2, 0.05)), [grey])
        board.location = (0, 0, 0.4 * k)
        bpy.context.scene.collection.objects.unlink(board)
        group.objects.link(board)
    shelf = things["shelf"] = bpy.data.objects.new("shelf", None)
    shelf.instance_type, shelf.instance_collection, shelf.location = "COLLECTION", group, (0.6, 1.2, 1.2)
    bpy.context.scene.collection.objects.link(shelf)
    lamp = things["lamp"] = mesh_object(
        "lamp",
        [(-0.5, -0.5, 2.49), (0.5, -0.5, 2.49), (0.5, 0.5, 2.49), (-0.5, 0.5, 2.49)],
        [(3, 2, 1, 0)],
        [paint("glow")],
    )
    principled = lamp.data.materials[0].node_tree.nodes["Principled BSDF"].inputs
    principled["Emission Color"].default_value, principled["Emission Strength"].default_value = (1, 0.9, 0.8, 1), 8
    for thing in things.values():
        thing.select_set(True)
    bpy.context.view_layer.update()
    return things


def add_cameras(folder, count=6, pixels=None):
    """Cameras around the room, each with an EXR behind it: `pixels(k)`, (h, w, 3) float32, or flat grey."""
    things = []
    for k in range(count):
        angle = 2 * math.pi * k / count
        data = bpy.data.cameras.new(f"cam {k}")
        data.lens, data.shift_x, data.sensor_width = 18, 0.03, 36
        thing = bpy.data.objects.new(f"cam {k}", data)
        thing.location = (0.5 * math.cos(angle), 0.4 * math.sin(angle), 1.4)
        thing.rotation_euler = (math.radians(75), 0, angle + 1.2)
        bpy.context.scene.collection.objects.link(thing)
        path = folder / f"photo_{k}.exr"
        write_exr(path, np.full((SIZE[1], SIZE[0], 3), 0.3, np.float32) if pixels is None else pixels(k))
        show(thing, path)
        things.append(thing)
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = (*SIZE, 100)
    bpy.context.view_layer.update()
    return things


def show(camera, path):
    """Lay a picture behind what a camera sees."""
    back = camera.data.background_images.new()
    back.image = bpy.data.images.load(str(path))
    return back


def node_trees():
    """Nodes, values and links of every material, in plain values."""
    found = {}
    for material in bpy.data.materials:
        tree = material.node_tree
        nodes = {
            node.name: (
                node.bl_idname,
                tuple(node.location),
                getattr(getattr(node, "image", None), "name", ""),
                {socket.identifier: plain(socket) for socket in node.inputs},
            )
            for node in tree.nodes
        }
        links = sorted(
            (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier)
            for link in tree.links
        )
        found[material.name] = nodes, links
    return found


def plain(socket):
    """A socket's value."""
    value = getattr(socket, "default_value", None)
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
