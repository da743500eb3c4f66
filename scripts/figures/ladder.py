"""What each step of the ladder of simplification is worth; see scripts/ladder."""

import json
import math
import os
import resource
import shutil
import subprocess

from common import (
    DOCS,
    REAL,
    Options,
    Programs,
    machine,
    real_data,
    say,
    table,
    write_between_markers,
)

# The names that examples/build_with.rs knows, and what build.json calls them.
STEPS = {
    "collapse": "edge collapse within texture seams",
    "prune": "edge collapse without the smallest separate parts",
    "oriented": "edge collapse of faces turned one way",
    "clustering": "vertex clustering",
    "prisms": "extruded footprints of separate bodies",
}
SETS = [*REAL, "glb"]
SAMPLES = 100_000


def main():
    quick = "two sets, two steps"
    arguments = Options("ladder", __doc__, quick, ("the fastest of how many builds", 1)).parse()
    programs = Programs(examples=["build_with"])
    wins, losses = [], []
    steps = list(STEPS)[1:]
    for name in SETS[3:5] if arguments.quick else SETS:
        models = real_data(name)
        if not models:
            continue
        say(f"{name}: all steps")
        whole = measured(programs, models, {}, arguments.runs)
        counts = whole["counts"]
        wins.append([f"`{name}`"] + [str(counts.get(text, 0)) for text in STEPS.values()])
        row = [f"`{name}`", f"{whole['seconds']:.2f}"]
        for step in steps[-2:] if arguments.quick else steps:
            say(f"{name}: without {step}")
            row.append(compared(measured(programs, models, {"without": step}, arguments.runs), whole))
        losses.append(row)
    head = ["", "seconds", *(f"without {step}" for step in steps)]
    if arguments.quick:
        head = head[:2] + head[-2:]
    text = "\n\n".join(
        [
            machine(),
            "Coarse nodes that each step gave, all of them written with their own budgets, however little "
            "they keep of the outline:",
            table(["", *STEPS], wins).rstrip(),
            "What a build without a step changes: the RMS distance of its coarse levels, two-sided, "
            f"by {SAMPLES:,} points a surface, and the RMS difference of colours, both as the "
            "geometric mean of the levels' ratios; and the processor seconds. Where nothing is "
            "said of distance and colour, no byte differs.",
            table(head, losses),
        ]
    )
    print(text)
    if arguments.write:
        write_between_markers(DOCS / "ladder.md", "figures", text)


# All nodes are written, with their own budgets: what loses much more would be compared with more
# triangles.
ALL_NODES = {"constants": {"outline": {"least_kept": 0.0}}}


def measured(programs, models, changes, runs):
    out = programs.work / f"ladder-{os.getpid()}"
    seconds = math.inf
    for _ in range(runs):
        shutil.rmtree(out, ignore_errors=True)
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        command = [programs.path("examples/build_with"), json.dumps({**ALL_NODES, **changes}), *map(str, models), str(out)]
        subprocess.run(command, check=True)
        seconds = min(seconds, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    report = json.loads((out / "build.json").read_text())
    scene = (out / "scene.hlod").read_bytes()
    command = [programs.path("hlod-build"), "verify", "--quiet", "--json"]
    command += ["--samples", str(SAMPLES), str(out)]
    done = subprocess.run(command, stdout=subprocess.PIPE)
    if done.returncode not in (0, 3):
        raise SystemExit(f"exit code {done.returncode} from {' '.join(command)}")
    levels = [level for level in json.loads(done.stdout)["levels"] if level["nodes"] + level["leaves_above"] > 2 * level["leaves"]]
    shutil.rmtree(out)
    return {
        "seconds": seconds,
        "scene": scene,
        "counts": {entry["text"]: entry["count"] for entry in report["outcomes"]},
        "rms": [level["two_sided"]["rms_relative"] for level in levels],
        "color": [level.get("color_rms") for level in levels],
    }


def compared(result, whole):
    seconds = f"{result['seconds'] / whole['seconds'] - 1:+.0%} s"
    if result["scene"] == whole["scene"]:
        return seconds
    parts = [f"{mean_ratio(result['rms'], whole['rms']) - 1:+.1%}"]
    if all(result["color"]) and all(whole["color"]):
        parts.append(f"{mean_ratio(result['color'], whole['color']) - 1:+.1%} colour")
    return ", ".join([*parts, seconds])


def mean_ratio(values, others):
    # Levels that are the source itself have no distance to compare.
    logs = [math.log(a / b) for a, b in zip(values, others) if a > 0 and b > 0]
    return math.exp(sum(logs) / max(1, len(logs)))


if __name__ == "__main__":
    main()
