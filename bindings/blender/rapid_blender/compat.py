"""Everything that differs between versions of Blender."""


def add_socket(tree, kind, name, is_output=False):
    """Adds an input or output to a node group. kind: "NodeSocketGeometry", ..."""
    if hasattr(tree, "interface"):  # from 4.0 on
        return tree.interface.new_socket(name, in_out="OUTPUT" if is_output else "INPUT", socket_type=kind)
    return (tree.outputs if is_output else tree.inputs).new(kind, name)


def input_identifier(tree, name):
    """Returns the key under which a modifier stores the value of a node group's input."""
    if hasattr(tree, "interface"):
        return next(one.identifier for one in tree.interface.items_tree if one.name == name and one.in_out == "INPUT")
    return tree.inputs[name].identifier


def named_attribute(tree, name, data_type):
    """Adds a node that reads an attribute, and returns the output with its values."""
    node = tree.nodes.new("GeometryNodeInputNamedAttribute")
    node.data_type = data_type
    node.inputs["Name"].default_value = name
    return next(one for one in node.outputs if one.enabled and one.name == "Attribute")


def is_own_attribute(attribute):
    """Returns false for the attributes that Blender itself keeps on a mesh. From 3.5 on they include the positions."""
    return not (attribute.name.startswith(".") or attribute.name in ("position", "material_index", "sharp_face",
                                                                     "sharp_edge", "crease_edge", "crease_vert"))
