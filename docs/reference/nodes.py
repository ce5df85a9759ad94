"""The reference of nodes in docs/lua-api.md: `rapid nodes --json | python3 docs/reference/nodes.py` writes it.

Each node has its documentation, a table of its parameters, the example of tests/docs/test_node_examples.lua, and a
picture: of a node written in Lua that of its scene, of others that of the example. --print writes the whole document
to standard output instead. --pictures RAPID draws the examples.
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCUMENT = ROOT / "docs/lua-api.md"
EXAMPLES = ROOT / "tests/docs/test_node_examples.lua"
PICTURES = ROOT / "docs/pictures"
BEGIN, END = "<!-- by docs/reference/nodes.py -->\n", "<!-- end -->\n"

# The examples whose pictures show what the node does.
DRAWN = ("collide", "contact", "curve_force", "distance", "emit", "goal", "picture", "spawn", "trail", "turbulence", "vortex")
LARGEST = 1e9  # a limit beyond this one only keeps numbers finite


def examples():
    """{node: scene}"""
    return dict(re.findall(r'^example "(\w+)" {\n  \[\[\n(.*?)\]\],\n', EXAMPLES.read_text(encoding="utf-8"), re.M | re.S))


def number(value):
    return f"{value:.14g}".replace("e-0", "e-")


def limits(param):
    low, high = param.get("min"), param.get("max")
    low = low if low is not None and low > -LARGEST else None
    high = high if high is not None and high < LARGEST else None
    if low is not None and high is not None:
        return f"{number(low)} to {number(high)}"
    if low is not None:
        return f"{'>' if param.get('above_min') else '≥'} {number(low)}"
    return f"≤ {number(high)}" if high is not None else ""


def type_of(param):
    kind = param["type"]
    if "choices" in param:
        also = re.search(r" or (function .*)", kind)
        kind = ", ".join(f'`"{choice}"`' for choice in param["choices"]) + (f" or {also[1]}" if also else "")
    parts = [kind, limits(param)]
    if param["per_point"]:
        parts.append("or attribute")
    if not param["of_the_frame"] and "function" not in kind:
        parts.append("constant")
    return ", ".join(part for part in parts if part)


def default_of(param):
    value = param["default"]
    if param["required"]:
        return "required"
    if value is None:
        return ""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, (int, float)):
        return number(value)
    if isinstance(value, list):
        return "`{" + ", ".join(map(number, value)) + "}`"
    if value == "inf":
        return "infinite"
    return f"`{value}`" if value.startswith("{") else f'`"{value}"`'


def sentence(doc):
    return f"{doc[0].upper()}{doc[1:]}{'' if doc.endswith('.') else '.'}".replace("|", "\\|")


def picture_of(name):
    scene = ROOT / f"graphs/nodes/{name}.lua"
    if scene.exists():
        return f"[![{name} in its scene](../graphs/nodes/pictures/{name}.png)](../graphs/nodes/{name}.lua)\n\n"
    return f"![frame 25 of the example](pictures/node-{name}.png)\n\n" if name in DRAWN else ""


def title_of(node):
    return f"rapid.{node['name']}" if node["name"] == "create" else f":{node['name']}"


def entry(node, scene, group):
    """The section of a node. group: the documentation of the parameter `group` that most nodes have."""
    params = [param for param in node["params"] if (param["name"], param["doc"]) != ("group", group)]
    rows = [(f"`{param['name']}`", type_of(param), default_of(param), param["unit"], sentence(param["doc"]))
            for param in params]
    if node["other_params"]:
        rows.append(("any other", "attribute value", "", "", sentence(node["other_params"])))
    table = "".join(f"| {' | '.join(row)} |\n".replace("|  |", "| |").replace("|  |", "| |") for row in rows)
    head = "| parameter | type | default | unit | meaning |\n|---|---|---|---|---|\n"
    return (f"### {title_of(node)}\n\n{node['doc']}\n\n" + (f"{head}{table}\n" if rows else "") + f"```lua\n{scene}\n```\n\n"
            + picture_of(node["name"]))


def document(nodes):
    """docs/lua-api.md with the reference as it should be."""
    text = DOCUMENT.read_text(encoding="utf-8")
    scenes = examples()
    group = next(param["doc"] for node in nodes if node["name"] == "gravity" for param in node["params"]
                 if param["name"] == "group")
    begin = text.index(BEGIN) + len(BEGIN)
    whole = [f"`{title_of(node)}`" for node in nodes if all(param["name"] != "group" for param in node["params"])]
    limited = textwrap.fill(f"All nodes but {', '.join(whole[:-1])} and {whole[-1]} also take `group`, which {group}.", 120)
    reference = "".join(entry(node, scenes[node["name"]], group) for node in nodes)
    return f"{text[:begin]}\n{limited}\n\n{reference}{text[text.index(END, begin):]}"


def draw(rapid):
    with tempfile.TemporaryDirectory() as folder:
        for name, scene in examples().items():
            if name in DRAWN:
                path = pathlib.Path(folder) / f"{name}.lua"
                path.write_text(f'local rapid = require "rapid"\n{scene}\n', encoding="utf-8")
                subprocess.run([rapid, "run", path, "-f", "25", "--size", "288x162", "--quiet", "-o",
                                PICTURES / f"node-{name}.png"], check=True)


def main():
    if sys.argv[1:2] == ["--pictures"]:
        draw(sys.argv[2])
        return
    text = document(json.load(sys.stdin))
    if "--print" in sys.argv:
        sys.stdout.write(text)
    else:
        DOCUMENT.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
