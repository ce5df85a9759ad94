"""Lines of the sources that can be broken, and how: a sign, a comparison or a constant."""
import pathlib
import re

# Lines that begin a statement, after one that ends a statement or opens a block.
STATEMENT = {
    ".cpp": re.compile(r" {4,}(return |if \(|while \(|for \(|[\w:<>*&.\[\]()]+( \w+)* [-+*/]?= ).*[;{)]$"),
    ".lua": re.compile(r" {2,}(return |if |while |local |[\w.\[\]]+ = ).*$"),
}
BEFORE = {".cpp": re.compile(r"[;{}:]$"), ".lua": re.compile(r".*\b(then|do|else|end)$|function.*\)$|^ *local ")}
# Strings, and expressions evaluated at compile time.
LEFT_OUT = {".cpp": re.compile(r"""["']|//|\b(constexpr|static_assert|static|case|template)\b"""),
            ".lua": re.compile(r"""["']|--|\[\[""")}

EXCHANGED = {"+": "-", "-": "+", "<": ">=", ">": "<=", "<=": ">", ">=": "<", "==": "!=", "!=": "==", "~=": "==",
             "&&": "||", "||": "&&"}
KINDS = {
    "sign": re.compile(r"(?<= )[-+](?= )"),
    "comparison": re.compile(r"(?<= )(<=?|>=?|[=!~]=|&&|\|\|)(?= )"),
    "constant": re.compile(r"(?<![\w.<])\d+(?:\.\d+)?(?:e-?\d+)?[fu]?(?![\w.>])"),
}

DECLARATION = re.compile(r"(?:const )?(?P<type>[\w:]+(?:<[\w:, ]+>)?) \w+ = (?P<value>.*);")
ASSIGNMENT = re.compile(r"[\w.\[\]()>*-]+ [-+*/]?= .*;")


class Place:
    """A part of one line, and its replacement."""

    def __init__(self, path, line, text, match, kind):
        self.path, self.line, self.text, self.kind = path, line, text, kind
        self.original, self.mutated = match[0], broken(match[0])
        self.start, self.end = match.span()

    def whole(self, replacement=None):
        """Returns the line with the part replaced; by default, the broken line."""
        part = self.mutated if replacement is None else replacement
        return self.text[:self.start] + part + self.text[self.end:]

    def __str__(self):
        return f"{self.path}:{self.line + 1}: {self.text.strip()}   ->   {self.whole().strip()}"


def broken(text):
    """Returns the opposite of a sign or a comparison, or a larger constant."""
    if text in EXCHANGED:
        return EXCHANGED[text]
    digits = text.rstrip("fu")
    if digits.isdigit():
        larger = str(int(digits) + 1 if int(digits) < 10 else 2 * int(digits))
    else:
        larger = repr(2 * float(digits) or 1.0)
    return larger + text[len(digits):]


def places_of(path):
    """Yields each part of a file that can be broken."""
    suffix = path.suffix
    lines = path.read_text(encoding="utf-8").splitlines()
    in_text = False  # a raw string over several lines
    for i in range(1, len(lines)):
        in_text = bool((in_text or re.search(r'R"\w*\(', lines[i - 1])) and not re.search(r'\)\w*"', lines[i - 1]))
        if (in_text or not STATEMENT[suffix].fullmatch(lines[i]) or not BEFORE[suffix].search(lines[i - 1])
                or LEFT_OUT[suffix].search(lines[i])):
            continue
        for kind, pattern in KINDS.items():
            for match in pattern.finditer(lines[i]):
                place = Place(path, i, lines[i], match, kind)
                if suffix == ".lua" or with_choice(place, 0):
                    yield place


def closing(text, start):
    """Returns the index of the parenthesis that closes the one at `start`, or None."""
    depth = 0
    for i in range(start, len(text)):
        depth += (text[i] == "(") - (text[i] == ")")
        if depth == 0:
            return i
    return None


def with_choice(place, number):
    """Returns the C++ line in both forms; rapid_mutant(number) selects the broken one. Returns None if the line does
    not allow that."""
    chosen = f"rapid_mutant({number})"
    if place.kind == "constant":
        return place.whole(f"({chosen} ? {place.mutated} : {place.original})")
    indent = len(place.text) - len(place.text.lstrip())
    changed = statement_with_choice(place.text[indent:], place.start - indent, place, chosen)
    return changed and place.text[:indent] + changed


def statement_with_choice(statement, start, place, chosen):
    end = start + len(place.original)
    other = statement[:start] + place.mutated + statement[end:]
    head = re.match(r"(?:if|while|for) \(", statement)
    if head:
        first, last = head.end(), closing(statement, head.end() - 1)
        if last is None or start < first:
            return None
        if start > last:  # in the body of the condition
            guarded = statement_with_choice(statement[last + 2:], start - last - 2, place, chosen)
            return guarded and statement[:last + 2] + guarded
        if ";" in statement[first:last]:
            parts = [first - 1] + [m.start() for m in re.finditer(";", statement[:last])]
            if not statement.startswith("for") or len(parts) != 3 or not parts[1] < start < parts[2]:
                return None
            first, last = parts[1] + 1, parts[2]
        elif " = " in statement[first:last] or statement.startswith("for"):
            return None
        moved = len(other) - len(statement)
        return (f"{statement[:first]}({chosen} ? ({other[first:last + moved].strip()}) : "
                f"({statement[first:last].strip()})){statement[last:]}")
    if not statement.endswith(";"):
        return None
    if statement.startswith("return ") or ASSIGNMENT.fullmatch(statement):
        return f"{{ if ({chosen}) {other} else {statement} }}"
    declaration = DECLARATION.fullmatch(statement)
    if not declaration or start < declaration.start("value"):
        return None
    first = declaration.start("value")
    if declaration["type"] == "auto":
        return f"{statement[:first]}{chosen} ? ({other[first:-1]}) : ({statement[first:-1]});"
    return (f"{statement[:first]}[&]() -> {declaration['type']} "
            f"{{ if ({chosen}) return {other[first:]} return {statement[first:]} }}();")


def layer_of(path):
    return str(path.parent) if path.parts[0] == "lua" else "/".join(path.parts[:2 if len(path.parts) > 2 else 1])


def sources():
    """Returns the sources that are broken, below the current folder."""
    for top, suffix in (("runtime", ".cpp"), ("bindings", ".cpp"), ("lua", ".lua")):
        for path in sorted(pathlib.Path(top).rglob(f"*{suffix}")):
            if path.parts[1] not in ("examples", "new"):  # examples for other programs
                yield path
