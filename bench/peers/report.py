"""The table as JSON and Markdown, and what it says about equal error."""

import json
import math

OURS = "lightpaths"
MEASURES = {"relmse": "relMSE", "flip": "FLIP"}


def write(table, folder):
    """Writes peers.json and peers.md; returns the latter's text."""
    table["equal_error"] = equal_error(table["rows"])
    (folder / "peers.json").write_text(json.dumps(table, indent=1) + "\n")
    text = markdown(table)
    (folder / "peers.md").write_text(text)
    return text


def markdown(table):
    width, height = table["size"]
    lines = [
        f"{table['scene']}, {width}×{height}, {table['processor']}, {table['threads']} threads; "
        f"errors against {table['reference']}.",
        "Seconds of rendering alone, after a warm-up.",
        "",
        "| renderer | setting | seconds | relMSE | FLIP | energy ratio |",
        "|---|---|---:|---:|---:|---:|",
    ]
    for row in table["rows"]:
        error = row.get("error") or {}
        seconds = figure(row["seconds"])
        cells = [row["renderer"], row["setting"], seconds, figure(error.get("relmse"))]
        cells += [figure(error.get("flip")), figure(error.get("energy_ratio"), 5)]
        lines.append("| " + " | ".join(cells) + " |")
    lines.append("")
    for name, found in table["equal_error"].items():
        lines.append(f"- {name}: {sentence(found)}")
    versions = sorted({f"{row['renderer']}: {row['version']}" for row in table["rows"] if row.get("version")})
    return "\n".join([*lines, "", *(f"- {version}" for version in versions)]) + "\n"


def figure(value, digits=3):
    return "NaN" if value is None else f"{value:.{digits}g}"


def sentence(found):
    return "; ".join(f"to our {name} {reach(found[key])}" for key, name in MEASURES.items())


def reach(found):
    if found["seconds"] is None:
        return found["how"]
    frames, firsts = (figure(found[key]) for key in ("frames", "firsts"))
    return f"{figure(found['seconds'])} s ({found['how']}) = {frames} relit frames of ours, {firsts} first ones"


def equal_error(rows):
    """For each peer, how long it takes to our relMSE and to our FLIP, and how many of our frames that is."""
    mine = [row for row in rows if row["renderer"] == OURS and row.get("error")]
    if not mine:
        return {}
    first = next(row["seconds"] for row in mine if "first frame" in row["setting"])
    relit = next(row["seconds"] for row in mine if "light moved" in row["setting"])
    answer = {}
    for name in dict.fromkeys(row["renderer"] for row in rows if row["renderer"] != OURS):
        good = [row for row in rows if row["renderer"] == name and row.get("error")]
        if not good:
            continue
        answer[name] = {}
        for key in MEASURES:
            points = [(row["seconds"], row["error"][key]) for row in good]
            converges = key == "relmse" and "Denoise" not in name
            seconds, how = seconds_to(points, mine[0]["error"][key], converges)
            answer[name][key] = {"seconds": seconds, "how": how}
            if seconds is not None:
                answer[name][key] |= {"frames": seconds / relit, "firsts": seconds / first}
    return answer


def seconds_to(points, error, converges):
    """Seconds at which a series of (seconds, error) reaches `error`, and how that is known."""
    points = sorted(points)
    if points[0][1] <= error:
        return points[0][0], "its cheapest setting is better already"
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if e1 <= error:
            share = math.log(e0 / error) / math.log(e0 / e1)
            return t0 * (t1 / t0) ** share, "between two settings"
    if converges:
        return points[-1][0] * points[-1][1] / error, "extrapolated: error falls as one over samples"
    return None, "not reached with any setting tried"
