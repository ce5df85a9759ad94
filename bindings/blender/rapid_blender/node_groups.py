"""The node groups that show points: one as a point cloud, one as instances of an object."""
import bpy

from . import compat

POINTS, INSTANCES = "Rapid Points", "Rapid Instances"


def _group(name, *inputs):
    """Returns a new node group from Geometry and further inputs to Geometry, and its input and output nodes."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    compat.add_socket(tree, "NodeSocketGeometry", "Geometry", is_output=True)
    for kind, label in (("NodeSocketGeometry", "Geometry"), *inputs):
        compat.add_socket(tree, kind, label)
    begin, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    end.location.x = 600
    return tree, begin, end


def _points():
    tree, begin, end = _group(POINTS, ("NodeSocketMaterial", "Material"))
    points, material = tree.nodes.new("GeometryNodeMeshToPoints"), tree.nodes.new("GeometryNodeSetMaterial")
    points.location.x, material.location.x = 200, 400
    link = tree.links.new
    link(begin.outputs["Geometry"], points.inputs["Mesh"])
    link(compat.named_attribute(tree, "radius", "FLOAT"), points.inputs["Radius"])
    link(points.outputs[0], material.inputs["Geometry"])
    link(begin.outputs["Material"], material.inputs["Material"])
    link(material.outputs[0], end.inputs[0])
    return tree


def _instances():
    tree, begin, end = _group(INSTANCES, ("NodeSocketObject", "Object"))
    info, copies = tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("GeometryNodeInstanceOnPoints")
    info.location.x, copies.location.x = 200, 400
    info.inputs["As Instance"].default_value = True
    link = tree.links.new
    link(begin.outputs["Object"], info.inputs["Object"])
    link(begin.outputs["Geometry"], copies.inputs["Points"])
    link(info.outputs["Geometry"], copies.inputs["Instance"])
    link(compat.named_attribute(tree, "rotation", "FLOAT_VECTOR"), copies.inputs["Rotation"])
    link(compat.named_attribute(tree, "radius", "FLOAT"), copies.inputs["Scale"])
    link(copies.outputs[0], end.inputs[0])
    return tree


def show(thing, group, **values):
    """Gives an object a modifier with one of the two groups, instead of one with the other."""
    tree = bpy.data.node_groups.get(group) or {POINTS: _points, INSTANCES: _instances}[group]()
    modifier = next((one for one in thing.modifiers
                     if one.type == "NODES" and one.node_group and one.node_group.name in (POINTS, INSTANCES)), None)
    modifier = modifier or thing.modifiers.new("Rapid", "NODES")
    if modifier.node_group != tree:
        modifier.node_group = tree
    for name, value in values.items():
        modifier[compat.input_identifier(tree, name)] = value
