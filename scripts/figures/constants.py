"""What each constant of the builder does to distance, bytes and time; see scripts/constants."""

import heapq
import json
import math
import os
import resource
import shutil
import subprocess

from common import DOCS, Options, Programs, machine, real_data, say, table, write_between_markers

SETS = [
    "oblique_a",
    "ingolstadt",
    "torcs_street1",
    "hamada",
    "wageningen",
    "lyon_houses",
    "3dfier",
]
CITY = {"blocks": 9, "triangles": 100_000, "texels_per_triangle": 17}
# Fronts from the first to the second of these shares of the leaves' triangles are compared.
FRONTS = (0.15, 0.6)

# Where half and twice are not what to try.
TRIED = {
    ("tree", "last_step_tolerance"): (1.0, 4.0),
    ("cut", "shortest_side"): (0.1, 0.6),
    ("cut", "least_share"): (0.25, 0.9),
    ("cut", "uneven_triangles"): (2.0, 32.0),
    ("cut", "uneven_space"): (0.0, 2.0),
    ("cut", "uncut"): (0.0, 1.0),
    ("border", "line_weight"): (0.0, 2.0),
    ("border", "triangle_height"): (1.0, 4.0),
    ("border", "overhang"): (0.0, 0.5),
    ("border", "overhang_heights"): (1.0, 16.0),
    ("border", "shared_height"): (2.0, 32.0),
    ("border", "shared_height_most"): (2.0, 5.0),
    ("simplify", "few_faces"): (0.0, 0.1),
    ("simplify", "far_part"): (0.5, 2.0),
    ("prisms", "cells"): (1 << 18, 1 << 22),
    ("prisms", "triangles_per_body"): (8, 24),
    ("prisms", "resolution"): (3.0, 8.0),
    ("prisms", "gap"): (1.0, 3.0),
    ("prisms", "footprint_penalty"): (3.0, 30.0),
    ("prisms", "slope"): (0.5, 2.0),
    ("prisms", "min_region"): (0.25, 1.0),
    ("prisms", "roof_deviations"): (0.0, 1.0),
    ("prisms", "least_height"): (0.0, 0.3),
    ("prisms", "least_walls"): (0.1, 0.6),
    ("prisms", "wall_rise"): (0.2, 0.7),
    ("outline", "least_kept"): (0.8, 0.95),
    ("outline", "exponent"): (0.6, 2.5),
    ("outline", "most_triangles"): (0.5, 1.0),
    ("measure", "points"): (256, 2048),
    ("measure", "aside"): (0.1, 0.6),
    ("measure", "most_smaller"): (0.5, 0.99),
    ("measure", "much_larger"): (2.0, 128.0),
}


def main():
    quick = "two constants on two sets"
    runs = ("the fastest of how many builds, thrice as many for those of measuring", 1)
    options = Options("constants", __doc__, quick, runs)
    options.add_argument("--groups", nargs="+", help="these alone, printed [all, written]")
    arguments = options.parse()
    programs = Programs(examples=["build_with"])
    sets = {name: real_data(name) for name in SETS}
    sets["a city"] = [programs.city("constants", **CITY)]
    sets = {name: models for name, models in sets.items() if models}
    defaults = json.loads(subprocess.check_output([programs.path("examples/build_with"), "{}"]))
    if arguments.groups:
        defaults = {group: defaults[group] for group in arguments.groups}
    if arguments.quick:
        sets = dict(list(sets.items())[1:3])
        defaults = {"cut": {"row": defaults["cut"]["row"], "uncut": defaults["cut"]["uncut"]}}
    head = ["", "", "distance", "bytes", "seconds", "moved most"]
    parts = []
    for group, constants in defaults.items():
        rows = []
        for name, value in constants.items():
            low, high = TRIED.get((group, name), (halved(value), 2 * value))
            changes = [{"constants": {group: {name: tried}}} for tried in (low, high)]
            # Of these all that may change is the time.
            runs = arguments.runs * (3 if group == "measure" else 1)
            whole, *results = built(programs, sets, [{}, *changes], runs)
            for tried, result in zip((low, high), results):
                say(f"{group}.{name} = {tried}")
                rows.append([f"`{name}` {value}", f"{tried}", *compared(result, whole)])
        parts += [f"### `{group}`", table(head, rows).rstrip()]
    text = "\n\n".join([machine(), *parts]) + "\n"
    print(text)
    if arguments.write and not arguments.groups:
        write_between_markers(DOCS / "constants.md", "figures", text)


def halved(value):
    return max(1, value // 2) if isinstance(value, int) else value / 2


def built(programs, sets, changes, runs):
    """Of each of some changes, what builds of each set are like."""
    results = [{} for _ in changes]
    for name, models in sets.items():
        tries = [[one(programs, models, change) for change in changes] for _ in range(runs)]
        for of_change, result in zip(zip(*tries), results):
            result[name] = min(of_change, key=lambda built: built["seconds"])
    return results


def one(programs, models, changes):
    out = programs.work / f"constants-{os.getpid()}"
    shutil.rmtree(out, ignore_errors=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    build = [programs.path("examples/build_with"), json.dumps(changes)]
    subprocess.run([*build, *map(str, models), str(out)], check=True)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    inspect = [programs.path("hlod-build"), "inspect", "--json", str(out)]
    scene = json.loads(subprocess.check_output(inspect))
    size = sum(path.stat().st_size for path in out.rglob("*.glb"))
    size += sum(texture["file_bytes"] for texture in scene["shared_textures"])
    record = (out / "scene.hlod").read_bytes()
    shutil.rmtree(out)
    return {"distance": distance(scene["nodes"]), "bytes": size, "seconds": seconds, "scene": record}


def distance(nodes):
    """The mean distance times the triangles of fronts, by refining where the stored error is
    largest: the geometric mean of all fronts from the first share of the leaves' triangles to the
    last. Nodes count with the triangles of the leaves below them.
    """
    children, weight = {}, {}
    for node in nodes:
        children.setdefault(node["parent"], []).append(node)
    for node in sorted(nodes, key=lambda node: -node["level"]):
        below = children.get(node["id"], [])
        weight[node["id"]] = sum(weight[child["id"]] for child in below) or node["triangles"]
    total = sum(weight[node["id"]] for node in children[None])
    triangles = sum(node["triangles"] for node in children[None])
    mean = sum(weight[node["id"]] * node["mean_error"] for node in children[None]) / total
    waiting = [(-node["geometric_error"], node["id"], node) for node in children[None]]
    heapq.heapify(waiting)
    first, last = (share * total for share in FRONTS)
    passed, sum_of_logs = 0.0, 0.0
    while waiting and triangles < last:
        _, _, node = heapq.heappop(waiting)
        below = children.get(node["id"], [])
        if not below:
            continue
        more = triangles + sum(child["triangles"] for child in below) - node["triangles"]
        # Until this step the front was as it is.
        length = math.log(min(max(more, first), last)) - math.log(max(triangles, first))
        if length > 0:
            sum_of_logs += length * math.log(max(mean, 1e-9) * max(triangles, first))
            passed += length
        triangles = more
        for child in below:
            mean += weight[child["id"]] * (child["mean_error"] - node["mean_error"]) / total
            heapq.heappush(waiting, (-child["geometric_error"], child["id"], child))
        mean = max(mean, 0.0)
    return math.exp(sum_of_logs / passed)


def compared(result, whole):
    if all(result[name]["scene"] == whole[name]["scene"] for name in whole):
        return ["same", "same", f"{seconds(result) / seconds(whole) - 1:+.0%}", ""]
    changes = {name: result[name]["distance"] / whole[name]["distance"] for name in whole}
    distance = math.exp(sum(map(math.log, changes.values())) / len(changes))
    size = math.exp(
        sum(math.log(result[name]["bytes"] / whole[name]["bytes"]) for name in whole) / len(whole)
    )
    most = max(changes, key=lambda name: abs(math.log(changes[name])))
    return [
        f"{distance - 1:+.1%}",
        f"{size - 1:+.1%}",
        f"{seconds(result) / seconds(whole) - 1:+.0%}",
        f"{most}: {changes[most] - 1:+.1%}",
    ]


def seconds(results):
    return sum(result["seconds"] for result in results.values())


if __name__ == "__main__":
    main()
