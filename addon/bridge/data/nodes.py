"""Node trees of materials and worlds."""

from __future__ import annotations

from collections.abc import Iterator

import bpy


def fresh_tree(owner: bpy.types.Material | bpy.types.World) -> tuple[bpy.types.Nodes, bpy.types.NodeLinks]:
    """Nodes and links of an owner's tree, emptied."""
    if owner.node_tree is None:  # from Blender 5.0 on each has its tree and the switch is deprecated
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree.nodes, owner.node_tree.links


def find_node(owner: bpy.types.Material | bpy.types.World | None, kind: str) -> bpy.types.Node | None:
    """The first node of a kind, such as 'BACKGROUND'; None where there is none."""
    nodes = owner.node_tree.nodes if owner and owner.node_tree else ()
    return next((node for node in nodes if node.type == kind), None)


def behind(socket: bpy.types.NodeSocket) -> Iterator[bpy.types.Node]:
    """The nodes that an input comes from, through whatever lies between."""
    waiting, seen = [socket], set()
    while waiting:
        for link in waiting.pop().links:
            if link.from_node not in seen:
                seen.add(link.from_node)
                yield link.from_node
                waiting.extend(link.from_node.inputs)


def image_node(socket: bpy.types.NodeSocket) -> bpy.types.ShaderNode | None:
    """The node whose image an input shows; None where it shows none."""
    return next((node for node in behind(socket) if node.type == "TEX_IMAGE" and node.image), None)


def mix_node(nodes: bpy.types.Nodes) -> tuple:
    """A node that mixes two colours, and its sockets: factor, the colours where that is 0 and 1, result."""
    mix = nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    # By type, as the node has sockets of the same name for each of its data types.
    factor = next(socket for socket in mix.inputs if socket.type == "VALUE")
    colours = [socket for socket in mix.inputs if socket.type == "RGBA"]
    return mix, factor, *colours, next(socket for socket in mix.outputs if socket.type == "RGBA")
