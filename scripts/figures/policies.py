"""Runs all policies side by side and writes their figures; see scripts/policies."""

import csv
import json
import subprocess
from concurrent.futures import ThreadPoolExecutor

import policies_summary
from common import DOCS, ROOT, Options, Programs, machine, real_data, run, say, write_between_markers
from policies_tables import (
    PATHS,
    POPPED,
    TARGETS,
    TOLD,
    by_path,
    causes,
    everything,
    pairs,
    pareto,
    pops,
)

REAL = ["oblique_a", "sceaux", "hamada", "ingolstadt"]
# Along these no constant was chosen.
ASIDE = ["oblique_b", "lyon_roads", "wageningen", "3dfier", "torcs_street1"]
# What a node takes on a card: bytes of a vertex, a triangle and a texel with its smaller versions.
HELD = [24, 6, 16 / 3]
# Milliseconds in which a fast card does not draw all there is.
FAST_TARGET = 1


def main():
    arguments = parse()
    programs = Programs(features=True, examples=["selection_time"])
    city = programs.city("city-policies", **city_options(arguments))
    scenes = built(programs, [("city", [city])])
    aside = []
    if not arguments.quick:
        scenes += built(programs, [(name, real_data(name)) for name in REAL])
        aside = built(programs, [(name, real_data(name)) for name in ASIDE])
    figures = measure(arguments, programs, scenes, aside)
    rows = figures["everywhere"]
    parts = [machine(), conditions(arguments), everything(rows), pareto(rows)]
    parts += [pairs(figures["means"]), pops(figures["pops"])]
    parts += [f"`{name}`, target {TOLD} ms:\n\n{by_path(rows, name)}" for name, _ in scenes]
    parts += [f"`{name}`, kept aside:\n\n{by_path(figures['aside'], name)}" for name, _ in aside]
    parts.append("Toggles a minute by their causes:\n\n" + causes(rows))
    text = joined(parts)
    summary = joined([policies_summary.table_of(figures), machine()])
    print(text, summary, sep="\n")
    if arguments.write:
        write_between_markers(DOCS / "policies.md", "policies", text)
        write_between_markers(ROOT / "README.md", "policies", summary)
        policies_summary.plot(rows, TARGETS, DOCS / "policies.svg")


def joined(parts):
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def built(programs, inputs):
    """Name and folder of each scene that there is data for."""
    scenes = []
    for name, models in inputs:
        if not models:
            continue
        out = programs.work / "policies" / name
        out.parent.mkdir(exist_ok=True)
        run([programs.path("hlod-build"), "--quiet", *map(str, models), str(out)])
        scenes.append((name, str(out)))
    return scenes


def measure(arguments, programs, scenes, aside):
    """All runs: rows of policies.csv by what they are for, and the means over those of `everywhere`.

    Two comparisons run side by side: by the model clock, how long they take changes nothing.
    """
    seeds = ["--seeds", str(arguments.seeds)]
    folders = [folder for _, folder in scenes]
    pictures = ["--reference-every", str(max(1, arguments.frames // 12)), *seeds]
    none = ["--reference-every", "0", *seeds]
    popped = ["--reference-every", str(arguments.frames), "--seeds", "1", "--pops"]
    card = ["--constants", str(ROOT / "scripts" / "figures" / "fast-card.json")]

    def replay(what, folders, paths, targets, *options, frames=arguments.frames):
        results = programs.work / f"policies-{what.replace(' ', '-')}"
        program = [programs.path("hlod-bench"), "policies", *folders, "--quiet"]
        listed = ["--paths", ",".join(paths), "--targets", ",".join(map(str, targets))]
        listed += ["--frames", str(frames)]
        run([*program, *listed, *options, "--out", str(results)])
        say(f"done: {what}")
        with open(results / "policies.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        with open(results / "policies.json", encoding="utf-8") as file:
            return rows, json.load(file)

    with ThreadPoolExecutor(max_workers=2) as pool:
        everywhere = pool.submit(replay, "everywhere", folders, PATHS, TARGETS, *pictures)
        # Every frame with a toggle is drawn.
        pops = pool.submit(
            replay, "every toggle", folders, POPPED, [TOLD], *popped, frames=arguments.frames // 3
        )
        fast = pool.submit(replay, "fast card", folders, PATHS, [FAST_TARGET], *pictures, *card)
        # Half of them to settle.
        still = pool.submit(
            replay, "standing", folders, ["still", "shake"], [TOLD], *none, frames=2 * arguments.frames
        )
        ahead = pool.submit(replay, "driving", folders, ["drive", "turn"], [TOLD], *none)
        short = [
            pool.submit(
                replay,
                f"short of memory {name}",
                [folder],
                ["turn", "orbit"],
                [TOLD],
                *none,
                "--max-memory",
                str(quarter(programs, folder)),
            )
            for name, folder in scenes
        ]
        if aside:
            others = [folder for _, folder in aside]
            kept_aside = pool.submit(replay, "kept aside", others, PATHS, [TOLD], *pictures)
    # Alone, since it is timed.
    selection = subprocess.check_output([programs.path("examples/selection_time")], text=True)
    return {
        "everywhere": everywhere.result()[0],
        "means": everywhere.result()[1],
        "pops": pops.result()[0],
        "aside": kept_aside.result()[0] if aside else [],
        "still": still.result()[0],
        "ahead": ahead.result()[0],
        "short": [row for one in short for row in one.result()[0]],
        "fast": fast.result()[0],
        "selection": selection,
    }


def quarter(programs, folder):
    """A quarter of the bytes that all nodes take in memory; more where roots alone take a third of that."""
    inspect = [programs.path("hlod-build"), "inspect", "--json", folder]
    scene = json.loads(subprocess.check_output(inspect))

    def texels(pictures):
        return sum(picture["width"] * picture["height"] for picture in pictures)

    def held(node):
        sizes = [node["vertices"], node["triangles"], node["texels"]]
        return sum(size * each for size, each in zip(sizes, HELD))

    shared = HELD[2] * texels(scene["shared_textures"])
    roots = sum(held(node) for node in scene["nodes"] if node["parent"] is None)
    return int(max((sum(map(held, scene["nodes"])) + shared) / 4, 3 * (roots + shared)))


def parse():
    options = Options("policies", __doc__, "a small city, 90 frames, one seed")
    options.add_argument("--frames", type=int, default=450, help="frames of each path, a third of them for every toggle, twice as many to settle [450]")
    options.add_argument("--seeds", type=int, default=1, help="routes and noises [1]")
    arguments = options.parse()
    if arguments.quick:
        arguments.frames, arguments.seeds = 90, 1
    return arguments


def city_options(arguments):
    triangles = 100_000 if arguments.quick else 1_000_000
    return {"blocks": 25, "triangles": triangles, "texels_per_triangle": 17}


def conditions(arguments):
    many = "one seed" if arguments.seeds == 1 else f"{arguments.seeds} seeds"
    return (
        f"{arguments.frames} frames a path after 300 at its first pose, twice as many where the camera stands or "
        f"sways, {many} of route, noise (4.5 %) and "
        "stalls (one in 10 s, 15 ms), 1280 × 720, model clock with lavapipe's constants, a cap of "
        "1 GiB. FLIP is against the leaves, of a dozen frames a run. *Late* are frames over the target "
        "by more than a tenth, *longest late* is how long they lasted in a row. *Used* is of the "
        "target, in frames in which finer detail was in memory. *Lacking* are frames in which a node "
        "would have been drawn that was not in memory. *Estimate* is how far frames were "
        "from what the engine's cost model expected, mean and deviation. The oracle has everything in "
        "memory."
    )


if __name__ == "__main__":
    main()
