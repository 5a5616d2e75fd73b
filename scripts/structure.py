#!/usr/bin/env python3
"""Draws which module of src/ imports which, as docs/images/structure.svg.

    scripts/structure.py            writes the drawing
    scripts/structure.py --check    fails if the drawing is not of this source

A row holds the modules of one layer (LAYERS in tests/interface.rs); an arrow leads from a module to
one that it imports. Left out are arrows to `error`, which every module imports, and arrows beside a
longer way.
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DRAWING = ROOT / "docs/images/structure.svg"
WIDTH, BOX, ROW, GAP = 760, (110, 34), 84, 26


def layers():
    """Layers of modules, the first at the bottom."""
    text = (ROOT / "tests/interface.rs").read_text()
    table = re.search(r"const LAYERS: .*?= &?\[(.*?)\];", text, re.S).group(1)
    return [re.findall(r'"(\w+)"', layer) for layer in re.findall(r"\[(.*?)\]", table, re.S)]


def imports(modules):
    """Pairs of a module and one that it imports."""
    found = set()
    for path in sorted((ROOT / "src").rglob("*.rs")):
        own = path.relative_to(ROOT / "src").parts[0].removesuffix(".rs")
        text = re.sub(r"//.*", "", path.read_text())
        names = set(re.findall(r"\bcrate::(\w+)", text))
        for group in re.findall(r"\bcrate::\{(.*?)\};", text, re.S):
            names |= set(re.findall(r"(?:^|,)\s*(\w+)", re.sub(r"\{[^}]*\}", "", group)))
        found |= {(own, name) for name in names & modules - {own, "error"} if own in modules}
    return found


def without_shortcuts(pairs):
    """The pairs without those that a chain of others implies."""
    def reaches(own, other, left_out):
        ways = [end for start, end in pairs if start == own and (start, end) != left_out]
        return other in ways or any(reaches(way, other, left_out) for way in ways)

    return {pair for pair in pairs if not reaches(*pair, pair)}


def draw():
    rows = layers()
    middle = {}
    for height, row in enumerate(reversed(rows)):
        for index, module in enumerate(row):
            left = WIDTH / 2 + (index - (len(row) - 1) / 2) * (BOX[0] + GAP)
            middle[module] = (left, 30 + height * ROW)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {len(rows) * ROW}" '
        'font-family="sans-serif" font-size="14">',
        '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="6" markerHeight="6" '
        'orient="auto"><path d="M0 0L8 4L0 8z" fill="#667"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{len(rows) * ROW}" fill="#fff"/>',
    ]
    for own, other in sorted(without_shortcuts(imports(set(middle)))):
        (x, y), (to_x, to_y) = middle[own], middle[other]
        down = BOX[1] / 2 if to_y > y else 0
        side = 0 if down else BOX[0] / 2 * (1 if to_x > x else -1)
        lines.append(
            f'<line x1="{x + side:.0f}" y1="{y + down:.0f}" x2="{to_x - side:.0f}" y2="{to_y - down:.0f}" '
            'stroke="#99a" marker-end="url(#head)"/>'
        )
    for module, (x, y) in middle.items():
        lines.append(
            f'<rect x="{x - BOX[0] / 2:.0f}" y="{y - BOX[1] / 2:.0f}" width="{BOX[0]}" height="{BOX[1]}" rx="5" '
            'fill="#eef2fa" stroke="#446"/>'
        )
        lines.append(f'<text x="{x:.0f}" y="{y + 5:.0f}" text-anchor="middle">{module}</text>')
    return "\n".join([*lines, "</svg>", ""])


def main():
    drawing = draw()
    if sys.argv[1:] == ["--check"]:
        if not DRAWING.is_file() or DRAWING.read_text() != drawing:
            sys.exit("structure: docs/images/structure.svg is of other source: run scripts/structure.py")
    else:
        DRAWING.write_text(drawing)


main()
