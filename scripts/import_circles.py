#!/usr/bin/env python3
"""Fails if files of src/ import each other in a circle, and prints the circles.

Tests do not count, nor does a module that hands on the names of its own files.
"""
import re
import sys
from pathlib import Path

SRC = Path(__file__).resolve().parent.parent / "src"


def module_of(path):
    parts = [*path.relative_to(SRC).with_suffix("").parts]
    return tuple(parts[:-1] if parts[-1] in ("mod", "lib") else parts)


def expand(prefix, tree):
    """The paths of a `use` declaration."""
    head, brace, rest = tree.strip().partition("{")
    if not brace:
        yield prefix + re.sub(r"\s+as\s+\w+|\s", "", tree)
        return
    depth, item = 0, ""
    for character in rest[: rest.rindex("}")] + ",":
        depth += {"{": 1, "}": -1}.get(character, 0)
        if character == "," and depth == 0:
            if item.strip():
                yield from expand(prefix + head.strip(), item)
            item = ""
        else:
            item += character


def paths_in(text):
    """Paths that a file names, and those that it hands on."""
    text = re.sub(r"#\[cfg\(test\)\][^{;]*\bmod \w+ \{.*", "", text, flags=re.S)
    text = re.sub(r"pub\(in [^)]*\)", "pub", re.sub(r"//.*", "", text))
    declaration = re.compile(r"^[ \t]*(pub(?:\(\w+\))?\s+)?use\s+([\w:{},\s*]+);", re.M)
    named, handed_on = [], []
    for is_public, tree in declaration.findall(text):
        paths = list(expand("", tree))
        named += paths
        handed_on += paths if is_public else []
    return named + re.findall(r"\b(?:crate|super)(?:::\w+)+", declaration.sub("", text)), handed_on


def main():
    files = {module_of(path): paths_in(path.read_text()) for path in sorted(SRC.rglob("*.rs"))}

    def absolute(own, path):
        parts = path.split("::")
        if parts[0] == "crate":
            return tuple(parts[1:])
        base = list(own)
        while parts and parts[0] == "super":
            base, parts = base[:-1], parts[1:]
        if path.startswith(("super", "self")) or (*own, parts[0]) in files:
            return (*base, *parts[parts[0] == "self" :])
        return None

    def file_of(path, depth=0):
        """The file that defines the last name of a path."""
        length = next(n for n in range(len(path), -1, -1) if path[:n] in files)
        module, rest = path[:length], path[length:]
        if rest and depth < 5:
            for handed in files[module][1]:
                there = absolute(module, handed)
                if there and there[-1] == rest[0]:
                    return file_of(there, depth + 1)
        return module

    imports = {}
    for own, (named, handed_on) in files.items():
        targets = [(name, absolute(own, name)) for name in named]
        found = [(name, file_of(target)) for name, target in targets if target]
        imports[own] = {f for name, f in found if f != own and not (name in handed_on and f[: len(own)] == own)}

    def reached(start):
        seen, waiting = set(), [start]
        while waiting:
            new = imports[waiting.pop()] - seen
            seen |= new
            waiting += new
        return seen

    reach = {own: reached(own) for own in imports}
    circles = {frozenset(other for other in reach[own] if own in reach[other]) for own in imports if own in reach[own]}
    for circle in circles:
        print("import_circles:", ", ".join(sorted("::".join(module) or "lib" for module in circle)), file=sys.stderr)
    sys.exit(bool(circles))


main()
