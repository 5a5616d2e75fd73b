"""The table as JSON and Markdown, and what it says about equal error."""

import json
import math

OURS = "lightpaths"
DENOISED = "Denoise"
TRUSTED = 3.0
"""Errors are told from the reference's noise from so many of its standard deviations on."""


def write(table, folder):
    """Writes peers.json and peers.md; returns the latter's text."""
    table["equal_error"] = equal_error(table)
    (folder / "peers.json").write_text(json.dumps(table, indent=1) + "\n")
    text = markdown(table)
    (folder / "peers.md").write_text(text)
    return text


def markdown(table):
    width, height = table["size"]
    lines = [
        f"{table['scene']}, {width}×{height}, {table['processor']}, {table['threads']} threads; "
        f"errors against {table['reference']}. {noise(table)}",
        "Seconds of rendering alone, after a warm-up.",
        "",
        "| renderer | setting | seconds | relMSE | without the reference's noise | FLIP | energy ratio |",
        "|---|---|---:|---:|---:|---:|---:|",
    ]
    for row in table["rows"]:
        error = row.get("error") or {}
        cells = [row["renderer"], row["setting"], figure(row["seconds"]), figure(error.get("relmse"))]
        cells += [figure(error.get("relmse_debiased")), figure(error.get("flip")), figure(error.get("energy_ratio"), 5)]
        lines.append(line(cells))
    lines += ["", *reached(table["equal_error"])]
    versions = sorted({f"{row['renderer']}: {row['version']}" for row in table["rows"] if row.get("version")})
    return "\n".join([*lines, "", *(f"- {version}" for version in versions)]) + "\n"


def noise(table):
    if table.get("reference_noise") is None:
        return "The noise of that one picture is in every relMSE."
    return f"Its noise is {figure(table['reference_noise'])} relMSE, known from its halves."


def reached(found):
    """A table of what each peer needs to be as good as ours."""
    if not found:
        return []
    lines = [
        "| to our error | of | seconds | a relit frame of ours | a first frame of ours | how |",
        "|---|---|---:|---:|---:|---|",
    ]
    for name, measures in found.items():
        for measure, answer in measures.items():
            ratios = [times(answer.get(key)) for key in ("frames", "firsts")]
            lines.append(line([name, measure, figure(answer["seconds"]), *ratios, answer["how"]]))
    return lines


def line(cells):
    return "| " + " | ".join(cells) + " |"


def figure(value, digits=3):
    return "NaN" if value is None else f"{value:.{digits}g}"


def times(value):
    return "NaN" if value is None else f"{figure(value)}×"


def relmse(error):
    """The relMSE to judge by: without the reference's noise if that is known."""
    return error.get("relmse_debiased", error["relmse"])


def equal_error(table):
    """For each peer, how long it takes to our relMSE and to our FLIP, and how many of our frames that is."""
    rows, scatter = table["rows"], TRUSTED * table.get("reference_scatter", 0.0)
    mine = [row for row in rows if row["renderer"] == OURS and row.get("error")]
    if not mine:
        return {}
    first = next(row["seconds"] for row in mine if "first frame" in row["setting"])
    relit = next(row["seconds"] for row in mine if "light moved" in row["setting"])
    goal = mine[0]["error"]
    answers = {}
    for name in dict.fromkeys(row["renderer"] for row in rows if row["renderer"] != OURS):
        good = [row for row in rows if row["renderer"] == name and row.get("error")]
        if not good:
            continue
        errors = [(row["spp"], row["seconds"], relmse(row["error"])) for row in good]
        flips = [(row["spp"], row["seconds"], row["error"]["flip"]) for row in good]
        if relmse(goal) <= scatter:
            by_relmse = None, "ours is not told from the reference's noise"
        elif DENOISED in name:
            by_relmse = between(errors, relmse(goal))
        else:
            by_relmse = by_samples(errors, relmse(goal), scatter)
        answers[name] = {"relMSE": by_relmse, "FLIP": between(flips, goal["flip"])}
        for measure, (seconds, how) in answers[name].items():
            answer = {"seconds": seconds, "how": how}
            if seconds is not None:
                answer |= {"frames": seconds / relit, "firsts": seconds / first}
            answers[name][measure] = answer
    return answers


def by_samples(points, goal, scatter):
    """Seconds at which a path tracer reaches `goal`, from (samples, seconds, error): its error is one over its samples.

    The most samples decide: what they measured is the least noisy.
    """
    told = [point for point in sorted(points) if point[2] > scatter]
    if not told:
        return None, "not told from the reference's noise"
    samples, seconds, error = told[-1]
    laws = [figure(n * e) for n, _, e in told]
    needed = samples * error / goal
    return seconds * error / goal, f"{needed:.0f} spp, by error · spp = {', '.join(laws)}: the last one"


def between(points, goal):
    """Seconds at which a series of (samples, seconds, error) with no law reaches `goal`, on logarithmic axes."""
    points = sorted(points)
    if points[0][2] <= goal:
        return points[0][1], f"better already at {points[0][0]} spp"
    for (n0, t0, e0), (n1, t1, e1) in zip(points, points[1:]):
        if e1 <= goal:
            # An error that is not told from none is reached at the latest where it was measured.
            share = math.log(e0 / goal) / math.log(e0 / e1) if e1 > 0.0 else 1.0
            return t0 * (t1 / t0) ** share, f"between {n0} and {n1} spp"
    return None, f"not reached at {points[-1][0]} spp"
