"""The scene of a simulation: its text, and what it declares: parameters, inputs, outputs."""
import json
import os
import pathlib
import re

import bpy

from . import library

_MODULE = "rapid_blender"          # the name under which a scene's first line requires inputs.lua
_LISTED = "rapid.host requested: "
_LUA = (pathlib.Path(__file__).resolve().parent / "inputs.lua").read_text(encoding="utf-8")


class Problem(Exception):
    """A mistake of the user. file, line and node say where it is, if it is in the scene."""

    def __init__(self, text, file="", line=0, node=""):
        super().__init__(text)
        self.file, self.line, self.node = file, line, node


def text_of(thing):
    """Returns the path that messages name, and the text of a simulation's scene."""
    own = thing.rapid
    if own.source == "TEXT":
        if own.text is None:
            raise Problem(f"{thing.name}: no scene is chosen; choose a text or a file")
        return bpy.path.abspath("//" + own.text.name, library=thing.library), own.text.as_string()
    if not own.file:
        raise Problem(f"{thing.name}: no scene is chosen; choose a text or a file")
    path = os.path.normpath(bpy.path.abspath(own.file, library=thing.library))
    try:
        return path, pathlib.Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise Problem(f"{path}: the scene cannot be read: {error}", path) from error


def settings_of(thing):
    """Returns the parameters that differ from their defaults."""
    return {one.name: one.value for one in thing.rapid.parameters if not _same(one.value, json.loads(one.default))}


def _same(value, default):
    if isinstance(default, list):  # Blender stores single precision
        return all(abs(a - b) <= 1e-6 * max(1, abs(b)) for a, b in zip(value, default))
    return value == default


def options(thing, **more):
    """Returns arguments of rapid.Scene and rapid.Run. more: entries of the table that inputs.lua uses."""
    name, text = text_of(thing)
    head = "".join(f"local {variable} = {_lua(value)}\n" for variable, value in {"inputs": {}, **more}.items())
    result = {"file": name, "text": f'require "{_MODULE}" {text}', "threads": thing.rapid.threads,
              "estimate_errors": False, "set": settings_of(thing),
              "find_module": lambda wanted: head + _LUA if wanted == _MODULE else None}
    if thing.rapid.seed >= 0:
        result["seed"] = thing.rapid.seed
    return result


def _lua(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"[{_lua(key)}] = {_lua(one)}" for key, one in value.items()) + " }"
    if isinstance(value, str):
        return '"' + re.sub(r'[\\"\n\r\0]', lambda one: f"\\{ord(one[0]):03d}", value) + '"'
    return json.dumps(value)


class Listing:
    """What a scene declares. It is opened with placeholders as inputs, or with the given table of inputs. If that fails,
    `problem` is the error, and only the inputs are known."""

    def __init__(self, thing, table=None):
        rapid = library.load()
        self.name, text = text_of(thing)
        self.inputs, self.messages, self.problem = [], [], None
        self.parameters, self.outputs, self.creates, self.first = {}, [], [], 1
        kinds = {one.name: kind_of(one) or "" for one in thing.rapid.inputs}
        known = options(thing, inputs=table) if table is not None else options(thing, inputs=kinds, listed=_LISTED)
        try:
            scene = self._open(rapid, known)
            frame = scene.advance()
            self.outputs, self.first = frame.outputs, scene.first_frame
            self.parameters = scene.parameters
            self.creates = [node["name"] for node in scene.nodes if node["type"] == "create"]
            frame.release()
            scene.release()
        except rapid.Error as error:
            self.problem = problem_of(error)
        self.lines = {name: _line_of(name, text) for name in self.inputs}

    def _open(self, rapid, known):
        """Opens the scene without the settings of parameters that it no longer has."""
        known["log"] = self._hear
        plain = rapid.Scene(**{**known, "set": {}})
        known["set"] = {name: value for name, value in known["set"].items() if name in plain.parameters}
        if not known["set"]:
            return plain
        plain.release()
        return rapid.Scene(**known)

    def _hear(self, text):
        for line in text.splitlines():
            if not line.startswith(_LISTED):
                self.messages.append(line)
            elif line[len(_LISTED):] not in self.inputs:
                self.inputs.append(line[len(_LISTED):])


def kind_of(one):
    """Returns what an input is for Rapid: "mesh", "points" or "curve". None: nothing fills it."""
    things = one.objects
    if not things:
        return None
    if one.kind == "OBJECT" and things[0].type == "EMPTY":
        return "points"
    if one.kind == "OBJECT" and things[0].type == "CURVE":
        curve = things[0].data
        return "mesh" if curve.bevel_depth or curve.extrude or curve.bevel_object else "curve"
    if one.kind == "OBJECT" and things[0].type == "MESH" and not things[0].modifiers and not things[0].data.polygons:
        return "points"
    return "mesh"


def problem_of(error):
    """Converts a rapid.Error."""
    text = error.text.replace(f'require "{_MODULE}" ', "")
    return Problem(text, error.file, error.line, error.node)


def _line_of(name, text):
    found = re.search(r"\bhost\s*\(?\s*[\"']" + re.escape(name) + r"[\"']", text)
    return text.count("\n", 0, found.start()) + 1 if found else 0


_HINT = re.compile(r"\s*\[([^\[\]]*)\]\s*$")
_NUMBER = r"-?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(rf"({_NUMBER})?\s*(?:,|to|\.\.)\s*({_NUMBER})?")


def declare(parameter, name, declared):
    """Gives a property the name, kind, range and default of a rapid.param. Its documentation may end with a hint:
    [0, 100], [0,] (a range), [rain | snow] (choices) or [color]. The value stays if its kind does."""
    hint = _HINT.search(declared["doc"])
    default, words = declared["default"], hint[1].strip() if hint else ""
    kind, minimum, maximum, choices = "NUMBER", None, None, ""
    if isinstance(default, bool):
        kind = "FLAG"
    elif isinstance(default, str):
        choices = "|".join(one.strip() for one in words.split("|")) if "|" in words else ""
        kind = "CHOICE" if default in choices.split("|") and choices else "TEXT"
    elif isinstance(default, tuple):
        kind = "COLOR" if words.lower() in ("color", "colour") else "VECTOR"
    elif words and (found := _RANGE.fullmatch(words)):
        minimum, maximum = (None if one is None else float(one) for one in found.groups())
    understood = kind in ("CHOICE", "COLOR") or minimum is not None or maximum is not None
    fresh = parameter.kind != kind or parameter.choices != choices or parameter.default == ""
    parameter.name, parameter.kind, parameter.choices = name, kind, choices
    parameter.doc = declared["doc"][:hint.start()] if understood else declared["doc"]
    was_default = not fresh and _same(parameter.value, json.loads(parameter.default))
    parameter.default = json.dumps(default)
    if fresh or was_default:
        parameter.value = default
    if kind == "NUMBER":
        low, high = -1e30 if minimum is None else minimum, 1e30 if maximum is None else maximum
        parameter["value"] = min(max(parameter["value"], low), high)
        parameter.id_properties_ui("value").update(default=default, min=low, max=high, soft_min=low, soft_max=high,
                                                   description=parameter.doc)


def reload(thing, table=None):
    """Reads the scene again, and adds and removes parameters, inputs and outputs. Returns the Listing."""
    listing, own = Listing(thing, table), thing.rapid
    names = listing.inputs
    if listing.problem or table is not None:  # then more may exist
        names = list(dict.fromkeys([one.name for one in own.inputs] + names))
    _keep_only(own.inputs, names)
    for name in names:
        one = own.inputs.get(name) or _added(own.inputs, name)
        one.line = listing.lines.get(name, one.line)
    if listing.problem:
        return listing
    _keep_only(own.parameters, listing.parameters)
    for name, declared in listing.parameters.items():
        declare(own.parameters.get(name) or own.parameters.add(), name, declared)
    _keep_only(own.outputs, listing.outputs)
    for place, name in enumerate(listing.outputs):
        one = own.outputs.get(name) or _added(own.outputs, name)
        if one.object is None:
            one.object = thing if place == 0 and not any(other.object == thing for other in own.outputs) \
                else _output_object(thing, name)
    return listing


def _added(collection, name):
    one = collection.add()
    one.name = name
    return one


def _keep_only(collection, names):
    for place in reversed(range(len(collection))):
        if collection[place].name not in names:
            collection.remove(place)


def _output_object(thing, name):
    made = bpy.data.objects.new(f"{thing.name} {name}", bpy.data.meshes.new(f"{thing.name} {name}"))
    for collection in thing.users_collection:
        collection.objects.link(made)
    return made
