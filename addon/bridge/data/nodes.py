"""Node trees of materials, worlds and modifiers; the world: light from directions where no surface was scanned."""

from collections.abc import Iterator

import bpy


def fresh_tree(owner: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree:
    """An owner's tree, emptied."""
    if owner.node_tree is None:  # from Blender 5.0 on each has its tree and the switch is deprecated
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


def add_node(tree: bpy.types.NodeTree, kind: str, *inputs, **settings) -> bpy.types.Node:
    """A node with some settings; for its first inputs the outputs that they are linked to, values, or None."""
    node = tree.nodes.new(kind)
    for name, value in settings.items():
        setattr(node, name, value)
    for socket, value in zip(node.inputs, inputs):
        feed(socket, value)
    return node


def feed(socket: bpy.types.NodeSocket, value) -> None:
    """Link an input to an output, or give it a value; None leaves it."""
    if isinstance(value, bpy.types.NodeSocket):
        socket.id_data.links.new(value, socket)
    elif value is not None:
        socket.default_value = value


def mix_node(tree: bpy.types.NodeTree, factor, first, second, **settings) -> bpy.types.NodeSocket:
    """The output of a node that mixes two colours, where `factor` is 0 and 1; each as for `add_node`."""
    mix = add_node(tree, "ShaderNodeMix", data_type="RGBA", **settings)
    # By type, as the node has sockets of the same name for each of its data types.
    feed(next(socket for socket in mix.inputs if socket.type == "VALUE"), factor)
    for socket, value in zip((socket for socket in mix.inputs if socket.type == "RGBA"), (first, second)):
        feed(socket, value)
    return next(socket for socket in mix.outputs if socket.type == "RGBA")


def find_node(owner: bpy.types.Material | bpy.types.World | None, kind: str) -> bpy.types.Node | None:
    """The first node of a kind, such as 'BACKGROUND'; None where there is none."""
    nodes = owner.node_tree.nodes if owner and owner.node_tree else ()
    return next((node for node in nodes if node.type == kind), None)


def image_node(socket: bpy.types.NodeSocket) -> bpy.types.ShaderNode | None:
    """The node whose image an input shows, directly or through other nodes; None where it shows none."""
    return next((node for node in _behind(socket, set()) if node.type == "TEX_IMAGE" and node.image), None)


def _behind(socket: bpy.types.NodeSocket, visited: set) -> Iterator[bpy.types.Node]:
    for link in socket.links:
        if link.from_node not in visited:
            visited.add(link.from_node)
            yield link.from_node
            for inner in link.from_node.inputs:
                yield from _behind(inner, visited)


def make_world(name: str, image: bpy.types.Image | None, strength: float = 1.0) -> bpy.types.World:
    """A world that shows an equirectangular picture of radiance, laid out as docs/architecture.md states, or black."""
    world = bpy.data.worlds.new(name)
    tree = fresh_tree(world)
    texture = image and add_node(tree, "ShaderNodeTexEnvironment", image=image, location=(-300, 0)).outputs[0]
    background = add_node(tree, "ShaderNodeBackground", (0, 0, 0, 1), strength)
    feed(background.inputs[0], texture)
    add_node(tree, "ShaderNodeOutputWorld", background.outputs[0], location=(300, 0))
    return world
