"""Copies a scene without the normals of its models, so that all renderers shade by the faces' own.

lightpaths lets smooth normals act where the camera looks, and on no bounce; the peers know no such difference.
"""

import re
from pathlib import Path

import scene as scenes


def write(spec, folder):
    """The copy's scene file."""
    source = scenes.find(spec)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    models = []

    def copy(match):
        name = f"{len(models)}-{Path(match[2]).name}"
        models.append(name)
        strip(source.parent / match[2], folder / name)
        return f'{match[1]}"{name}"'

    text = re.sub(r'(?m)^(\s*file\s*=\s*)"([^"]+)"', copy, source.read_text(encoding="utf-8"))
    copied = folder / f"{source.stem}-flat.toml"
    copied.write_text(text, encoding="utf-8")
    return copied


def strip(source, target):
    """One OBJ file without its normals, and the MTL files that it names."""
    lines = []
    for line in source.read_text(encoding="utf-8-sig").splitlines():
        keyword, rest = scenes.statement(line)
        if keyword == "vn":
            continue
        if keyword == "mtllib":
            (target.parent / rest).write_bytes((source.parent / rest).read_bytes())
        if keyword == "f":
            line = "f " + " ".join(word.split("/")[0] for word in rest.split("#")[0].split())
        lines.append(line)
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")
