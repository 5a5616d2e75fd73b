"""One table: what Mitsuba, Cycles and lightpaths make of a scene, in how many seconds.

run.py SCENE [options]           the table; --help lists the options
run.py witness [SCENE…] [options]   our path tracer against Mitsuba's, pixel by pixel
run.py features [SCENE…] [options]  our frames against Mitsuba under emitters and skies, with holes and panes
"""

import argparse
import os
import platform
import sys
from pathlib import Path

import features
import flat
import report
import truth
import witness
from ours import Ours
from peers import PeerError, Peers, cores
from scene import SceneError, find, load

REFERENCE_SEEDS = 1000, 1001
"""Of the reference's halves; far from the seeds of what is judged."""


def numbers(text):
    return [int(word) for word in text.split(",") if word]


def pictures(text):
    files = [Path(word) for word in text.split(",") if word]
    if len(files) not in (1, 2):
        raise argparse.ArgumentTypeError("one picture or two halves expected: A.exr or A.exr,B.exr")
    return files


def pixels(text):
    width, height = text.split("x")
    return [int(width), int(height)]


def options(parser):
    """Those that both modes share."""
    parser.add_argument("--size", type=pixels, metavar="WxH", help="instead of the scene's")
    parser.add_argument("--threads", type=int, default=cores(), help="cores for every renderer [all]")
    parser.add_argument("--lightpaths", metavar="FILE", help="the program [target/release/lightpaths]")
    parser.add_argument("--device", help="Vulkan device for ours [the program's choice]")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/peers"), metavar="DIR")


def arguments(words):
    parser = argparse.ArgumentParser(
        prog="run.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", help="a .toml scene file or a built-in scene")
    parser.add_argument(
        "--spp", type=numbers, default=[16, 64, 256, 1024], help="of both path tracers [16,64,256,1024]"
    )
    parser.add_argument(
        "--denoised-spp", type=numbers, default=[1, 4, 16, 64], help="of Cycles with Open Image Denoise"
    )
    parser.add_argument(
        "--reference",
        type=pictures,
        metavar="A.exr[,B.exr]",
        help="independent halves of a reference, or one picture, whose noise then counts [Mitsuba's]",
    )
    parser.add_argument("--reference-spp", type=int, default=4096, help="of both halves together [4096]")
    parser.add_argument("--preset", default="paper", help="of ours [paper]")
    parser.add_argument("--frames", type=int, default=10, help="of ours to time [10]")
    parser.add_argument("--flat", action="store_true", help="without the models' normals")
    options(parser)
    return parser.parse_args(words)


def same_cores(threads):
    """Keeps this process and all it starts on the first `threads` cores, where the system lets it."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:threads])


def processor():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def peer_rows(peers, args, scene, folder):
    """Renders by all peers, one after another; a peer that cannot gets one row that says why."""
    series = [
        ("mitsuba", "Mitsuba, path", args.spp, False),
        ("cycles", "Cycles, path", args.spp, False),
        ("cycles", "Cycles + Open Image Denoise", args.denoised_spp, True),
    ]
    rows = []
    for name, title, samples, denoise in series:
        stem = f"{name}-denoised" if denoise else name
        renders = [{"spp": n, "denoise": denoise, "out": str((folder / f"{stem}-{n}.exr").resolve())} for n in samples]
        if not renders:
            continue
        print(f"peers: {title}, {samples} samples per pixel", file=sys.stderr)
        answer = peers.render(name, scene, renders, args.size)
        if isinstance(answer, dict):
            rows.append({"renderer": title, "setting": answer["refused"], "spp": None, "seconds": None, "image": None})
            continue
        for done in answer:
            row = {"renderer": title, "setting": f"{done['spp']} spp", "spp": done["spp"]}
            rows.append(row | {"version": done["renderer"], "seconds": done["seconds"], "image": done["out"]})
    return rows


def our_rows(ours, args, scene, folder):
    """Ours: one picture, priced as a first frame and as a frame after a light has moved."""
    print(f"peers: lightpaths, preset {args.preset}", file=sys.stderr)
    image = folder / "lightpaths.exr"
    ours.render(scene, image, *ours.preset)
    entry, device = ours.time(scene, args.frames)
    first = entry["precompute_s"] + entry["ms"]["Ttot"] / 1e3
    common = {"renderer": "lightpaths", "spp": None, "version": device, "image": str(image)}
    prices = [("first frame, precomputation included", first), ("frame from scratch (Ttot)", entry["ms"]["Ttot"] / 1e3)]
    prices.append(("light moved (Tlight)", entry["ms"]["Tlight"] / 1e3))
    return [common | {"setting": f"{args.preset}: {what}", "seconds": seconds} for what, seconds in prices]


def reference(peers, ours, args, scene, folder):
    """What everything is held against."""
    mean = folder / "reference.exr"
    if args.reference:
        name = " and ".join(str(file) for file in args.reference)
        if len(args.reference) == 1:
            return truth.Truth(args.reference[0], name)
        return truth.of_halves(args.reference, name, ours, mean)
    each = max(args.reference_spp // 2, 1)
    files = [folder / f"reference-{half}.exr" for half in "ab"]
    print(f"peers: reference, twice {each} samples per pixel by Mitsuba", file=sys.stderr)
    renders = [{"spp": each, "seed": seed, "out": str(file.resolve())} for seed, file in zip(REFERENCE_SEEDS, files)]
    answer = peers.render("mitsuba", scene, renders, args.size)
    if isinstance(answer, dict):
        raise PeerError(f"no reference: {answer['refused']}; give one with --reference A.exr,B.exr")
    seeds = " and ".join(str(seed) for seed in REFERENCE_SEEDS)
    return truth.of_halves(files, f"Mitsuba, 2 × {each} spp, seeds {seeds}", ours, mean)


def main(words):
    args = arguments(words)
    same_cores(args.threads)
    scene = find(args.scene)
    folder = args.output / scene.stem
    folder.mkdir(parents=True, exist_ok=True)
    if args.flat:
        scene = flat.write(scene, folder)
    peers = Peers(args.threads)
    ours = Ours(args.lightpaths, args.threads, args.size, args.device, args.preset)
    standard = reference(peers, ours, args, scene, folder)
    rows = peer_rows(peers, args, scene, folder) + our_rows(ours, args, scene, folder)
    images = dict.fromkeys(row["image"] for row in rows if row["image"])
    errors = {image: standard.errors(ours.compare(image, standard.file)) for image in images}
    for row in rows:
        row["error"] = errors.get(row["image"])
    size = args.size or load(scene).camera.size
    table = {
        "scene": scene.stem,
        "size": list(size),
        "threads": args.threads,
        "processor": processor(),
    }
    print(report.write(table | standard.facts() | {"rows": rows}, folder))


if __name__ == "__main__":
    try:
        if sys.argv[1:2] == ["witness"]:
            sys.exit(witness.main(sys.argv[2:], options))
        if sys.argv[1:2] == ["features"]:
            sys.exit(features.main(sys.argv[2:], options))
        main(sys.argv[1:])
    except (PeerError, SceneError, OSError) as problem:
        sys.exit(f"peers: {problem}")
