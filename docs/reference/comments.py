#!/usr/bin/env python3
"""Converts the plain comments of a promised header into documentation for Doxygen. The first comment documents the
file. A comment above declarations documents all up to the next empty line or comment; one after a declaration documents
everything on its line. `/* ---- TITLE. TEXT */` begins a section. Used as INPUT_FILTER; argument: the file."""
import re
import sys

SEVERAL = re.compile(r"\s*[\w:<>, ]+[^()]*, *[^()]*;\s*$")  # declarations in one line
OPENING = re.compile(r"\s*(template|struct|class|enum|namespace|typedef struct \w+ {|typedef enum|using|#)")


def parts(line):
    """Splits a line into code and comment text; the text is None without a comment. A C comment must end on its
    line."""
    code, _, text = re.match(r"((?:[^/\"]|/(?![/*])|\"[^\"]*\")*)(//|/\*)?(.*)", line).groups()
    if len(code) == len(line):
        return line, None
    return code, text.removesuffix("*/").rstrip()


def as_lines(text):
    """Converts C comments to C++ comments, one per line."""
    def lines(match):
        indent, body = match.groups()
        return "\n".join(f"{indent}//{'' if line.startswith(' ') or not line else ' '}{line}"
                         for line in (re.sub(r"^\s*\*? ?", " ", part, count=1).rstrip() for part in body.split("\n")))
    return re.sub(r"^([ \t]*)/\*(.*?)\s*\*/$", lines, text, flags=re.DOTALL | re.MULTILINE)


def runs(lines):
    """Yields runs of lines: a comment, with the declarations that it documents."""
    run = ([], [])
    for line in lines:
        code, text = parts(line)
        is_comment = text is not None and not code.strip()
        if not line.strip() or (is_comment and run[1]):
            yield run
            run = ([], [])
        if is_comment:
            run[0].append(text)
        else:
            run[1].append(line)
    yield run


def declared(line):
    code, text = parts(line)
    if text is None:
        return [line]
    return [f"/// {text}", "/// @{", code, "/// @}"] if SEVERAL.match(code) else [f"{code}///<{text}"]


def documented(lines):
    yield "/// @file"
    section = False
    for comment, code in runs(lines):
        title = re.match(r" ---- ([^.:]*)[.:]?(.*)", comment[0]) if comment else None
        if title:
            if section:
                yield "/// @}"
            yield f"/// @name {title.group(1)}"
            yield from (f"///{text}" for text in [title.group(2), *comment[1:]])
            yield "/// @{"
            section = True
        else:
            yield from (f"///{text}" for text in comment)
        body = [line for line in code if line.strip()]
        closing = [line for line in body if re.match(r"\s*(}|private:|public:)", line)]
        inside = body[:body.index(closing[0])] if closing else body
        ends = sum(line.rstrip().endswith((";", "}")) or parts(line)[1] is not None for line in inside)
        several = comment and not title and inside and not OPENING.match(inside[0]) and (
            ends > 1 or SEVERAL.match(inside[0]))
        if several:
            yield "/// @{"
        for line in code:
            if several and closing and line is closing[0]:
                yield "/// @}"
            if section and line.startswith("#if defined(__cplusplus)"):
                yield "/// @}"
                section = False
            yield from declared(line)
        if several and not closing:
            yield "/// @}"


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        print("\n".join(documented(as_lines(file.read()).split("\n"))))


main()
