"""How well a node's gain is told by what a policy knows of it; see scripts/gain."""

import csv
import math
import subprocess
from collections import defaultdict
from pathlib import Path

from common import (
    DOCS,
    Options,
    Programs,
    machine,
    real_data,
    run,
    say,
    table,
    write_between_markers,
)

SETS = [
    "ingolstadt",
    "sceaux",
    "oblique_a",
    "oblique_b",
    "hamada",
    "lyon_houses",
    "wageningen",
]
CITY = {"blocks": 16, "triangles": 1_100_000}
PATHS = ["walk", "fly", "rise", "orbit"]
# A route that the comparison of policies does not take.
SEED = "7"
FRAMES = "900"
# Triangles that take as long as a draw call.
DRAW_CALL = 100
# In views where less FLIP than this can be gained, summed over pixels, any order will do.
LEAST_GAIN = 500


def error(power):
    """Errors in pixels to a power, of which that of the children is taken away."""

    def per_pixel(node):
        scale = node["pixels_per_metre"]
        own, children = node["mean_m"] * scale, node["children_mean_m"] * scale
        return max(own**power - children**power, 0)

    return per_pixel


def measured(node):
    return (node["flip_sum"] - node["children_flip_sum"]) / max(node["seen"], 1)


PER_PIXEL = {
    "all pixels alike": lambda node: 1,
    "error in pixels": error(1),
    "its square root": error(0.5),
    "its fourth root": error(0.25),
    "e / (e + 2 pixels)": lambda node: saturated(node, 2),
    "FLIP itself": measured,
}


def saturated(node, half):
    own, children = (
        node[name] * node["pixels_per_metre"] for name in ("mean_m", "children_mean_m")
    )
    return max(own / (own + half) - children / (children + half), 0)


def main():
    options = Options("gain", __doc__)
    options.add_argument("--samples", nargs="+", type=Path, help="written by an earlier run")
    arguments = options.parse()
    files = arguments.samples or list(samples())
    views = defaultdict(list)
    for file in files:
        for row in csv.DictReader(file.open()):
            view = (row.pop("scene"), row.pop("path"), row["frame"])
            views[view].append({name: float(value) for name, value in row.items()})
    rows = []
    for name, per_pixel in PER_PIXEL.items():
        row = [name]
        for area in ("covered", "seen"):
            left = lost(views, lambda node, area=area: node[area] * per_pixel(node))
            row.append(f"{left:.2f}")
        rows.append(row)
    head = ["times, for each pixel", "under the box", "seen"]
    text = f"{machine()}\n\n{len(views)} views of {scenes(views)} scenes.\n\n{table(head, rows)}"
    print(text)
    if arguments.write:
        write_between_markers(DOCS / "policies.md", "gain", text)


def scenes(views):
    return len({scene for scene, _, _ in views})


def samples():
    """Samples every scene; the files."""
    programs = Programs(examples=["gain_samples"], features=True)
    inputs = {"city": [programs.city("gain-city", **CITY)]}
    inputs.update({name: real_data(name) for name in SETS})
    for name, models in inputs.items():
        if not models:
            continue
        out, file = programs.work / f"gain-{name}-out", programs.work / f"gain-{name}.csv"
        run([programs.path("hlod-build"), "--quiet", *map(str, models), str(out)])
        paths = []
        for kind in PATHS:
            path = str(programs.work / f"gain-{name}-{kind}.csv")
            make = ["make-path", str(out), "--kind", kind, "--seed", SEED]
            make += ["--frames", FRAMES, "--out", path]
            run([programs.path("hlod-bench"), *make])
            paths.append(path)
        say(f"sampling {name}")
        with file.open("w") as written:
            sampler = programs.path("examples/gain_samples")
            subprocess.run([sampler, str(out), *paths], check=True, stdout=written)
        yield file


def lost(views, gain):
    """FLIP that is left when nodes are refined in the order of `gain` over price, over what is left in
    the best order: mean over scenes, of sums over views and over tenths of all that is to be spent."""
    sums = defaultdict(lambda: [0.0, 0.0])
    for (scene, _, _), nodes in views.items():
        if sum(map(drop, nodes)) < LEAST_GAIN:
            continue
        by_gain = sorted(nodes, key=lambda node: -gain(node) / price(node))
        best = sorted(nodes, key=lambda node: -drop(node) / price(node))
        sums[scene][0] += left_over(by_gain)
        sums[scene][1] += left_over(best)
    return math.fsum(found / least for found, least in sums.values()) / max(len(sums), 1)


def drop(node):
    return node["flip_sum"] - node["children_flip_sum"]


def price(node):
    return max(node["children_triangles"] - node["triangles"], 0) + DRAW_CALL


def left_over(nodes):
    """Sum over tenths of all that is to be spent of what is left then."""
    whole = math.fsum(map(price, nodes))
    total, left = 0.0, math.fsum(map(drop, nodes))
    spent = 0.0
    for node in nodes:
        after = spent + price(node)
        for tenth in range(1, 10):
            at = whole * tenth / 10
            if spent < at <= after:
                total += left - drop(node) * (at - spent) / price(node)
        spent, left = after, left - drop(node)
    return total


if __name__ == "__main__":
    main()
