# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the materials of an object show a normal map.

Materials are copied first: the original, and other objects, use them as well.
"""

import bpy

# A custom property of a material that was copied for an object: the name of the object.
_COPIED = "tolvol_normals_of"
# The label of the nodes that show the normal map, so that a later bake finds them.
_LABEL = "Normals of the Reference"


def show(ob, image, uv_map):
    """Shows `image` in all materials of `ob`, and makes one if it has none. Returns warnings."""
    mesh, warnings, copies = ob.data, [], {}
    if not mesh.materials:
        mesh.materials.append(None)
    for slot in ob.material_slots:
        before = slot.material
        if before not in copies:
            copies[before] = _own(ob, before)
            if _add_nodes(copies[before], image, uv_map):
                warnings.append(f"The normal map of the material {before.name} was replaced in the copy for {ob.name}")
        slot.material = copies[before]
    return warnings


def _own(ob, material):
    if material is None:
        material = bpy.data.materials.new(ob.name)
    elif material.get(_COPIED) != ob.name or material.library is not None:
        material = material.copy()
    material[_COPIED] = ob.name
    material.use_nodes = True
    return material


def _add_nodes(material, image, uv_map):
    """Adds the nodes, or changes those of an earlier bake. Returns whether another normal map was replaced."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    for node in [node for node in nodes if node.label == _LABEL]:
        nodes.remove(node)
    place, texture, normal = (
        nodes.new(kind) for kind in ("ShaderNodeUVMap", "ShaderNodeTexImage", "ShaderNodeNormalMap")
    )
    for i, node in enumerate((place, texture, normal)):
        node.label, node.location = _LABEL, (300 * i - 1200, -400)
    place.uv_map, texture.image, normal.space, normal.uv_map = uv_map, image, "TANGENT", uv_map
    links.new(place.outputs["UV"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], normal.inputs["Color"])
    replaced = False
    for node in nodes:
        socket = node.inputs.get("Normal")
        if socket is None or not (node.type == "BUMP" or node.bl_idname.startswith("ShaderNodeBsdf")):
            continue
        before = socket.links[0].from_node if socket.is_linked else None
        if before is None or before.type == "NORMAL_MAP":
            links.new(normal.outputs["Normal"], socket)
            replaced = replaced or before is not None
    return replaced
