"""The names of everything that C, C++ and Python offer. `python3 docs/reference/faces.py` writes the table in
docs/host.md.

Names are read from the headers and the module. A function of C is rapid_SUBJECT_VERB, and VERB is a member of the class
in the other two languages. tests/python/test_faces.py fails if a language lacks a name, or if the table is outdated.
"""
import ast
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCUMENT = ROOT / "docs/host.md"
BEGIN, END = "<!-- by docs/reference/faces.py -->\n", "<!-- end -->\n"

# By the subject in C: the class in C++ and the class in Python. None: functions of no class.
CLASSES = {"scene": ("Scene", "Scene"), "frame": ("SceneFrame", "Frame"), "snapshot": ("SceneSnapshot", "Snapshot"),
           "shapes": ("SceneShapes", "Shapes"), "run": ("SceneRun", "Run"), "error": ("SceneError", "Error"),
           None: (None, None)}

# Objects that programs offer: classes in C++ and Python, calls in C.
OFFERS = {"mesh": ("HostMesh", "Mesh"), "points": ("HostPoints", "Points"), "shape": ("HostShape", "Shape"),
          "node": ("HostNode", "Force, Edit, Constraint")}

# Python's constructors, and functions that only Python has, for notebooks and loops.
CONSTRUCTORS = {"open", "open_text", "make"}
PYTHON_ALONE = {"Frame.categories", "Frame.show", "Scene.run"}


def read(path):
    return (ROOT / path).read_text(encoding="utf-8")


def without_comments(text):
    return re.sub(r"/\*.*?\*/", "", re.sub(r"//[^\n]*", "", text), flags=re.S)


def functions_in_c():
    """Returns {subject: {verb: function}}. A list's count and its member are one verb."""
    found = {subject: {} for subject in CLASSES}
    offers = {}
    declarations = re.findall(r"^(?:int|void|const char\*|size_t|u?int64_t|double) (rapid_\w+)\(",
                              without_comments(read("include/rapid/rapid.h")), re.M)
    for function in declarations:
        name = function[len("rapid_"):]
        subject, _, verb = name.partition("_")
        if subject in ("offers", "call"):
            offers[verb] = function
        elif subject in CLASSES:
            if verb != "release":  # the destructor, or Python's release()
                found[subject][verb] = function
        else:
            found[None][name] = function
    for verbs in found.values():
        for verb in [verb for verb in verbs if verb.endswith("_count")]:
            one = verb.removesuffix("_count")
            del verbs[verb]
            verbs[one + ("es" if one.endswith("sh") else "s")] = verbs.pop(one)
    return found, offers


def body_of(name, text):
    """Returns the public part of a class or struct."""
    begin = re.search(rf"^(?:class|struct) {name}\b[^;{{]*{{", text, re.M).end()
    return re.split(r"^private:", text[begin:text.index("\n};", begin)], flags=re.M)[0]


def names_in_cpp():
    text = without_comments("".join(read(f"include/rapid/{header}.h") for header in ("scene", "shapes", "run", "merge")))
    found = {}
    for subject, (name, _) in CLASSES.items():
        if name:
            body = body_of(name, text)
            members = re.findall(r"^    [\w:<>,*& ]*?[\w>*&] (\w+)\(", body, re.M)
            if subject == "error":
                members += re.findall(r"^    [\w:]+ (\w+)(?: = \w+)?;", body, re.M)
            found[subject] = {member for member in members if member not in ("operator", name)}
        else:
            free = re.findall(r"^(?:std::string_view|Result<\w+>) (\w+)\(", text, re.M)
            found[subject] = set(free)
    return found


def names_in_python():
    classes, functions = {}, set()
    for file in ("__init__", "_library", "_offers"):
        for node in ast.parse(read(f"bindings/python/rapid/{file}.py")).body:
            if isinstance(node, ast.FunctionDef) and file == "__init__":
                functions.add(node.name)
            if isinstance(node, ast.ClassDef):
                classes[node.name] = node
    # Scene and Run have their options and callbacks from one class.
    found = {None: {name for name in functions if not name.startswith("_") and name != "main"}}
    for subject, (_, name) in CLASSES.items():
        if not name:
            continue
        names = set()
        for node in ast.walk(classes[name]):
            if isinstance(node, ast.FunctionDef):
                names.add(node.name)
            elif subject == "error" and isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
                names.add(node.attr)
        for node in classes[name].body:
            if isinstance(node, ast.Assign):
                names.update(target.id for target in node.targets)
        if "__init__" in names and subject in ("scene", "run"):
            names |= CONSTRUCTORS & {"scene": {"open", "open_text"}, "run": {"make"}}[subject]
        local = {"guarded", "told", "release"}
        found[subject] = {one for one in names if not one.startswith("_") and one not in local
                          and f"{name}.{one}" not in PYTHON_ALONE}
    return found, set(classes)


def members_of_options():
    """Returns the names of a scene's options in each of the three languages."""
    c = re.search(r"typedef struct rapid_options {(.*?)} rapid_options;", without_comments(read("include/rapid/rapid.h")), re.S)
    in_c = set(re.findall(r"\(\*(\w+)\)\(|(\w+);", c[1]))
    in_c = {pointer or member for pointer, member in in_c} - {"size", "user", "offers", "set_count", "path_count"}
    cpp = body_of("SceneOptions", without_comments(read("include/rapid/scene.h")))
    in_cpp = set(re.findall(r"[ >](\w+)(?: = [^;]*)?;", cpp)) - {"objects", "nodes", "guard_callbacks"}
    tree = ast.parse(read("bindings/python/rapid/__init__.py"))
    scene = next(node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == "Scene")
    init = next(node for node in scene.body if isinstance(node, ast.FunctionDef) and node.name == "__init__")
    in_python = {argument.arg for argument in init.args.kwonlyargs} - {"text", "objects", "nodes"}
    return in_c, in_cpp, in_python


def differences():
    """Returns a line for each name that one of the three lacks."""
    (c, offers), cpp, (python, classes) = functions_in_c(), names_in_cpp(), names_in_python()
    lines = []
    for subject, (in_cpp, in_python) in CLASSES.items():
        for verb in sorted(set(c[subject]) | cpp[subject] | python[subject]):
            for face, has, name in (("C", verb in c[subject], f"rapid_{subject}_{verb}" if subject else f"rapid_{verb}"),
                                    ("C++", verb in cpp[subject], f"{in_cpp}::{verb}" if in_cpp else verb),
                                    ("Python", verb in python[subject], f"{in_python}.{verb}" if in_python else verb)):
                if not has:
                    lines.append(f"{face} has no {name}")
    hosts = set(re.findall(r"^struct (Host\w+) {", read("include/rapid/offers.h"), re.M))
    for verb, (in_cpp, in_python) in OFFERS.items():
        lines += [f"C has no rapid_offers_{verb}"] * (verb not in offers)
        lines += [f"C++ has no {in_cpp}"] * (in_cpp not in hosts)
        lines += [f"Python has no {name}" for name in in_python.split(", ") if name not in classes]
    options = members_of_options()
    for name in sorted(set.union(*options)):
        lines += [f"{face} has no option {name}" for face, names in zip(("C", "C++", "Python"), options) if name not in names]
    return lines


def table():
    (c, _), rows = functions_in_c(), ["| C | C++ | Python |\n", "|---|---|---|\n"]
    for subject, (in_cpp, in_python) in CLASSES.items():
        for verb, function in sorted(c[subject].items()):
            cpp = f"{in_cpp}::{verb}" if in_cpp else verb
            python = in_python if verb in CONSTRUCTORS else f"{in_python}.{verb}" if in_python else verb
            rows.append(f"| `{function}` | `{cpp}` | `{python}` |\n")
    for verb, (in_cpp, in_python) in OFFERS.items():
        rows.append(f"| `rapid_offers_{verb}` | `{in_cpp}` | `{'`, `'.join(in_python.split(', '))}` |\n")
    return "".join(rows)


def document():
    """Returns docs/host.md with the current table."""
    text = DOCUMENT.read_text(encoding="utf-8")
    begin = text.index(BEGIN) + len(BEGIN)
    return text[:begin] + table() + text[text.index(END, begin):]


if __name__ == "__main__":
    DOCUMENT.write_text(document(), encoding="utf-8")
