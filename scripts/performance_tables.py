#!/usr/bin/env python3
"""Prints the tables of docs/performance.md from the document of `time`.

    lightpaths time --frames 5 --lights 1 --predict gbps=3000,grays=1.5,us=3 --json tables.json
    scripts/performance_tables.py tables.json

The scenes must be box, atrium and room. Without --predict there is no table of predictions.
"""
import json
import sys

SCENES = ["box", "atrium", "room"]
EDITS = {
    "Ttot": "all",
    "Tlight": "light",
    "Tview": "camera",
    "Tmat": "material",
    "colour": "colour",
    "idle": "idle",
}
RAYS = {
    "camera, closest": "closest_coherent",
    "reflected, closest": "closest_incoherent",
    "to a light, any": "any_coherent",
    "pairs, any": "any_incoherent",
}
COPIES = [
    ("the device's copy", lambda document: document["copy_gbps"]),
    ("kernel, four words an invocation", lambda document: document["kernel_copy_gbps"]["texels"]),
    ("kernel, one word an invocation", lambda document: document["kernel_copy_gbps"]["words"]),
]
COUNTS = [
    ("submissions", lambda edit: edit["submissions"]),
    ("bytes read back", lambda edit: edit["read_back_bytes"]),
    ("dispatches", lambda edit: edit["dispatches"]),
    ("barriers", lambda edit: edit["barriers"]),
    ("barriers, without waits", lambda edit: edit["free_barriers"]),
    ("camera rays, 10³", lambda edit: edit["rays"]["camera"]),
    ("shadow rays, 10³", lambda edit: edit["rays"]["shadow"]),
    ("of `direct`, 10³", lambda edit: rays(edit, "direct")),
    ("of `shadow_edges`, 10³", lambda edit: rays(edit, "shadow_edges")),
    ("of `form_factors`, 10³", lambda edit: rays(edit, "form_factors")),
    ("fragments, 10³", lambda edit: edit["counts"]["fragments"]),
    ("mixed fragments, 10³", lambda edit: edit["counts"]["mixed_fragments"]),
    ("pixels at shadow edges, 10³", lambda edit: edit["counts"]["shadow_edges"]),
    ("shadow rays spared, 10³", lambda edit: edit["counts"]["spared_rays"]),
    ("records weighed, 10³", lambda edit: edit["counts"]["weighed_records"]),
    ("splat weights, 10³", lambda edit: edit["counts"]["splat_weights"]),
    ("records gathered", lambda edit: edit["gathered"]),
    ("MB", lambda edit: edit["bytes"] / 1000),
]


def rays(edit, name):
    return sum(one["rays"] for one in edit["passes"] if one["name"] == name)


def table(title, head, rows):
    print(f"\n{title}\n")
    print("| " + " | ".join(head) + " |")
    print("|---" * len(head) + "|")
    for cells in rows:
        print("| " + " | ".join(cells) + " |")


def with_host(rates, kind):
    """Our rate; in brackets that of obvhs, where it was measured, and the ratio of both."""
    ours, host = rates["device"][kind], (rates["host"] or {}).get(kind)
    return f"{ours:.2f} ({host:.2f}, {100 * ours / host:.0f} %)" if host else f"{ours:.2f}"


def percent(fraction):
    return "-" if fraction is None else f"{100 * fraction:.1f} %"


def pass_rows(scenes):
    merged = [{}, {}, {}]
    for passes, scene in zip(merged, scenes):
        for one in scene["passes"]:
            passes.setdefault(one["name"], one)
    for name in merged[0]:
        found = [passes.get(name) for passes in merged]
        cells = [(f"{one['ms']:.1f}", percent(one["share_of_floor"])) if one else ("-", "-") for one in found]
        yield [f"`{name}`", *sum(cells, ())]
    sums = [(scene["floors_ms"], scene["floored_ms"]) for scene in scenes]
    cells = [(f"{floor:.0f} of {all_ms:.0f}", percent(floor / all_ms)) for floor, all_ms in sums]
    yield ["sum of floors", *sum(cells, ())]


def thousands(value):
    return "0" if value == 0 else f"{value / 1000:.0f}" if value >= 1e5 else f"{value / 1000:.1f}"


def count_rows(scenes):
    """A cell has the values of all scenes, or one value if they are equal."""
    for what, count in COUNTS:
        scaled = what.endswith("10³") or what == "MB"
        cells = []
        for edit in EDITS:
            values = [count(scene["edits"][edit]) for scene in scenes]
            texts = [thousands(value) if scaled else str(value) for value in values]
            cells.append(texts[0] if len(set(texts)) == 1 else " / ".join(texts))
        yield [what, *cells]


def prediction_rows(scenes):
    for scene in scenes:
        for key, label in [("predicted_ms", "passes one by one"), ("predicted_free_ms", "without waits")]:
            values = [scene["edits"][edit][key] for edit in EDITS]
            yield [f"{scene['name']}, {label}", *(f"{value:.2f}" for value in values)]


def predicted_passes(scenes):
    names = [one["name"] for one in scenes[0]["edits"]["Ttot"]["passes"]]
    for name in names:
        cells = []
        for scene in scenes:
            found = [one for one in scene["edits"]["Tlight"]["passes"] if one["name"] == name]
            cells.append(f"{found[0]['predicted_ms']:.3f}" if found else "-")
        if any(cell != "-" for cell in cells):
            yield [f"`{name}`", *cells]


def main(path):
    with open(path, encoding="utf-8") as file:
        document = json.load(file)
    by_name = {scene["name"]: scene for scene in document["scenes"]}
    scenes = [by_name[name] for name in SCENES]
    print(f"{document['device']['name']}, {document['device']['driver']}")
    table("Copies", ["copy", "GB/s"], [[what, f"{rate(document):.1f}"] for what, rate in COPIES])
    rates = [scene["mrays_per_s"] for scene in scenes]
    rows = ([what, *(with_host(rate, kind) for rate in rates)] for what, kind in RAYS.items())
    table("Rays, 10⁶ a second", ["rays", *SCENES], rows)
    head = ["pass", *sum(([f"{name}, ms", "of floor"] for name in SCENES), [])]
    table("Passes", head, pass_rows(scenes))
    edits = [edit for edit in EDITS if edit in scenes[0]["ms"]]
    rows = [
        [f"{edit}, {label}", *(f"{ms(scene, edit):.1f}" for scene in scenes)]
        for edit in edits
        for label, ms in [
            ("passes one by one", lambda scene, edit: scene["ms"][edit]),
            ("without waits", lambda scene, edit: scene["free_ms"][edit]["median"]),
        ]
    ]
    table("Edits, ms", ["column", *SCENES], rows)
    table("Counts: " + " / ".join(SCENES), ["count", *EDITS.values()], count_rows(scenes))
    if document["assumed_rates"]:
        table(f"Predictions, ms: {document['assumed_rates']}", ["scene", *EDITS.values()], prediction_rows(scenes))
        table("Predictions of a moved light, ms", ["pass", *SCENES], predicted_passes(scenes))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
