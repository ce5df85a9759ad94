"""What a .blend stores of a simulation: properties of the object that shows its points. They hold no state of a bake."""
import bpy
from bpy.props import (BoolProperty, CollectionProperty, EnumProperty, FloatVectorProperty, IntProperty, PointerProperty,
                       StringProperty)


class RapidInput(bpy.types.PropertyGroup):
    """What fills one rapid.host "NAME" of the scene."""
    name: StringProperty()
    line: IntProperty()
    kind: EnumProperty(name="Kind", items=[
        ("OBJECT", "Object", "A mesh with its modifiers, a curve, text, or an empty", "OBJECT_DATA", 0),
        ("COLLECTION", "Collection", "All meshes of a collection together", "OUTLINER_COLLECTION", 1)])
    object: PointerProperty(type=bpy.types.Object)
    collection: PointerProperty(type=bpy.types.Collection)

    @property
    def objects(self):
        if self.kind == "OBJECT":
            return [self.object] if self.object else []
        return list(self.collection.all_objects) if self.collection else []


_choices = {}  # Blender stores no reference to the strings of an enumeration


def _choice_items(parameter, _context):
    return _choices.setdefault(parameter.choices, [(one, one, "") for one in parameter.choices.split("|")])


class RapidParameter(bpy.types.PropertyGroup):
    """A rapid.param of the scene. A number is the custom property "value", which has a range of its own."""
    name: StringProperty()
    doc: StringProperty()
    default: StringProperty(description="As JSON")
    kind: EnumProperty(items=[(one, one, "") for one in ("NUMBER", "FLAG", "TEXT", "CHOICE", "VECTOR", "COLOR")])
    choices: StringProperty(description="Separated by |")
    flag: BoolProperty()
    text: StringProperty()
    choice: EnumProperty(items=_choice_items)
    vector: FloatVectorProperty(size=3)
    color: FloatVectorProperty(size=3, subtype="COLOR", min=0, soft_max=1)

    FIELDS = {"NUMBER": '["value"]', "FLAG": "flag", "TEXT": "text", "CHOICE": "choice", "VECTOR": "vector",
              "COLOR": "color"}

    @property
    def value(self):
        value = self["value"] if self.kind == "NUMBER" else getattr(self, self.FIELDS[self.kind])
        return tuple(value) if self.kind in ("VECTOR", "COLOR") else value

    @value.setter
    def value(self, value):
        if self.kind == "NUMBER":
            self["value"] = float(value)
        else:
            setattr(self, self.FIELDS[self.kind], value)


class RapidOutput(bpy.types.PropertyGroup):
    """An output of the scene, and the object whose mesh has its points."""
    name: StringProperty()
    object: PointerProperty(type=bpy.types.Object)


class RapidSimulation(bpy.types.PropertyGroup):
    is_simulation: BoolProperty()
    source: EnumProperty(name="Scene", items=[("TEXT", "Text", "A text of this file"), ("FILE", "File", "A .lua file")])
    text: PointerProperty(type=bpy.types.Text, name="Text")
    file: StringProperty(name="File", subtype="FILE_PATH")
    inputs: CollectionProperty(type=RapidInput)
    parameters: CollectionProperty(type=RapidParameter)
    outputs: CollectionProperty(type=RapidOutput)
    start: IntProperty(name="Start", default=1, description="The frame of Blender that is the first one of the scene")
    threads: IntProperty(name="Threads", min=0, max=1024, description="0: all of the machine")
    folder: StringProperty(name="Cache", subtype="DIR_PATH",
                           description="Folder of the bake. Empty: rapid/NAME OF THE OBJECT beside the .blend")
    every: IntProperty(name="Snapshots", default=10, min=1,
                       description="Frames between two snapshots, from which a stopped bake continues")
    seed: IntProperty(name="Seed", min=-1, default=-1, description="-1: the scene's own")


CLASSES = (RapidInput, RapidParameter, RapidOutput, RapidSimulation)


def simulations(scene):
    """Returns the objects of a scene that are simulations."""
    return [thing for thing in scene.objects if thing.rapid.is_simulation]
