"""OpenEXR files of 32-bit floats, one part, scan lines: all that is needed here, without a library.

Written without compression; read without it or with ZIP, as lightpaths writes.
"""

import struct
import sys
import zlib
from array import array
from itertools import accumulate
from pathlib import Path

MAGIC = 20000630
FLOAT = 2
LONG_NAMES = 0x400
LINES = {0: 1, 2: 1, 3: 16}
"""Lines of a block, by compression: none, ZIPS, ZIP."""


def write(path, size, planes):
    """`planes` maps channel names to width·height floats each, row-major from the top left."""
    width, height = size
    names = sorted(planes)
    rows = {name: as_array(planes[name]) for name in names}
    for name in names:
        if len(rows[name]) != width * height:
            raise ValueError(f"channel {name}: {len(rows[name])} values, {width * height} expected")
    channels = b"".join(name.encode() + struct.pack("<xiB3xii", FLOAT, 0, 1, 1) for name in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = [
        ("channels", "chlist", channels),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1.0)),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0.0, 0.0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1.0)),
    ]
    header = struct.pack("<ii", MAGIC, 2)
    for name, kind, value in attributes:
        header += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value
    header += b"\0"
    line = 4 * width * len(names)
    first = len(header) + 8 * height
    blocks = [struct.pack(f"<{height}Q", *(first + y * (8 + line) for y in range(height)))]
    for y in range(height):
        blocks.append(struct.pack("<ii", y, line))
        blocks += [rows[name][y * width : (y + 1) * width].tobytes() for name in names]
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(path.name + ".part")
    partial.write_bytes(header + b"".join(blocks))
    partial.replace(path)


def read(path):
    """Size, and a float array for each channel. ValueError for other kinds of file."""
    data = Path(path).read_bytes()
    magic, version = struct.unpack_from("<ii", data)
    if magic != MAGIC or version & ~LONG_NAMES != 2:
        raise ValueError(f"{path}: not a one-part scan line EXR file")
    attributes, at = {}, 8
    while data[at]:
        name, at = text(data, at)
        _, at = text(data, at)
        (length,) = struct.unpack_from("<i", data, at)
        attributes[name] = data[at + 4 : at + 4 + length]
        at += 4 + length
    compression = attributes["compression"][0]
    if compression not in LINES:
        raise ValueError(f"{path}: compressed, and not by ZIP")
    low_x, low_y, high_x, high_y = struct.unpack("<4i", attributes["dataWindow"])
    width, height = high_x - low_x + 1, high_y - low_y + 1
    names, position, channels = [], 0, attributes["channels"]
    while channels[position]:
        name, position = text(channels, position)
        if struct.unpack_from("<i", channels, position)[0] != FLOAT:
            raise ValueError(f"{path}: channel {name} does not hold 32-bit floats")
        position += 16
        names.append(name)
    planes = {name: array("f", bytes(4 * width * height)) for name in names}
    lines, line = LINES[compression], 4 * width * len(names)
    for offset in struct.unpack_from(f"<{-(-height // lines)}Q", data, at + 1):
        y, length = struct.unpack_from("<ii", data, offset)
        top, rows = y - low_y, min(lines, height - (y - low_y))
        block = data[offset + 8 : offset + 8 + length]
        if length < rows * line:
            block = unzip(block)
        if len(block) != rows * line:
            raise ValueError(f"{path}: line {y} is damaged")
        for row in range(rows):
            for index, name in enumerate(names):
                start = row * line + 4 * width * index
                planes[name][(top + row) * width : (top + row + 1) * width] = as_array(block[start : start + 4 * width])
    return (width, height), planes


def unzip(block):
    """Undoes what ZIP did: differences of bytes, of which the even ones stand before the odd ones."""
    block = zlib.decompress(block)
    block = bytes(accumulate(block, lambda before, step: (before + step - 128) & 255))
    middle = (len(block) + 1) // 2
    whole = bytearray(len(block))
    whole[0::2], whole[1::2] = block[:middle], block[middle:]
    return bytes(whole)


def text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def as_array(values):
    if isinstance(values, array) and values.typecode == "f":
        floats = values
    else:
        floats = array("f")
        floats.frombytes(values) if isinstance(values, (bytes, bytearray, memoryview)) else floats.extend(values)
    if sys.byteorder == "big":
        floats.byteswap()
    return floats
