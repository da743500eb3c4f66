"""Compares builds with those of an earlier commit; see scripts/against."""

import json
import os
import resource
import shutil
import statistics
import subprocess
from pathlib import Path

from common import (
    DOCS,
    ROOT,
    Options,
    REAL,
    Programs,
    machine,
    real_data,
    say,
    table,
    write_between_markers,
)

# Before trees were balanced, errors were bounds and nodes had 2,000 triangles.
COMMIT = "29fd983"


def main():
    runs = ("builds by each, of which the median counts", 3)
    options = Options("against", __doc__, "one small city", runs, real=True)
    options.add_argument("--commit", default=COMMIT, help=f"the earlier commit [{COMMIT}]")
    options.add_argument("--program", help="its hlod-build, where that is compiled already")
    arguments = options.parse()
    programs = Programs()
    earlier = arguments.program or compiled(programs, arguments.commit)
    rows = []
    for name, models, ways in inputs(programs, arguments):
        say(f"{name}, by turns")
        rows.append([name, *compared(programs, earlier, models, ways, arguments.runs)])
    head = ["", "seconds", "", "ratio", "measuring", "", "MB", "", "nodes", ""]
    text = (
        f"{machine()}\n\nProcessor seconds of a build with one thread, what of it is measuring, and "
        f"what is written: {arguments.commit}, then the present; the ratio is how many times as fast "
        f"the present is. Medians of {arguments.runs} builds by turns, default options, where "
        f"nothing else is said.\n\n{table(head, rows)}"
    )
    print(text)
    if arguments.write:
        write_between_markers(DOCS / "benchmarks.md", "against", text)


def inputs(programs, arguments):
    """Names, models, and options of the present programs."""
    if arguments.quick:
        yield "city, 0.1 M", [programs.city("against-quick", blocks=2, triangles=100_000)], []
        return
    city = {"blocks": 16, "triangles": 1_000_000}
    usual = [programs.city("against-17", **city, texels_per_triangle=17)]
    yield "city, 1 M, 17 texels", usual, []
    yield "the same, 900 triangles a node", usual, ["--desired-tris", "900"]
    yield "the same, 5,000", usual, ["--desired-tris", "5000"]
    yield "the same, 10,000", usual, ["--desired-tris", "10000"]
    yield "city, 1 M, 105 texels", [programs.city("against-105", **city, texels_per_triangle=105)], []
    if not arguments.no_real:
        for name in REAL:
            if models := real_data(name):
                yield f"`{name}`", models, []


def compiled(programs, commit):
    """hlod-build as it was at a commit."""
    source, target = programs.work / f"source-{commit}", programs.work / f"target-{commit}"
    if not source.exists():
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(source)], check=True)
    subprocess.run(["git", "checkout", "--quiet", commit], cwd=source, check=True)
    command = ["cargo", "build", "--release", "--locked", "--bin", "hlod-build"]
    environment = {**os.environ, "CARGO_TARGET_DIR": str(target)}
    subprocess.run([*command, "--no-default-features"], cwd=source, env=environment, check=True)
    return str(target / "release" / "hlod-build")


def compared(programs, earlier, models, options, runs):
    ways = [(earlier, []), (programs.path("hlod-build"), options)]
    results = [[], []]
    for _ in range(runs):
        for (program, options), found in zip(ways, results):
            found.append(built(programs, program, options, models))
    before, after = ([statistics.median(values) for values in zip(*found)] for found in results)
    return [
        f"{before[0]:.2f}",
        f"{after[0]:.2f}",
        f"{before[0] / after[0]:.2f}",
        f"{before[1]:.2f}",
        f"{after[1]:.2f}",
        f"{before[2]:.1f}",
        f"{after[2]:.1f}",
        f"{before[3]:,.0f}",
        f"{after[3]:,.0f}",
    ]


def built(programs, program, options, models):
    out = Path(programs.work) / f"against-{os.getpid()}"
    shutil.rmtree(out, ignore_errors=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    command = [program, "--quiet", "--threads", "1", *options, *map(str, models), str(out)]
    subprocess.run(command, check=True)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    report = json.loads((out / "build.json").read_text())
    measuring = {stage["stage"]: stage["seconds"] for stage in report["stages"]}["measure"]
    megabytes = sum(file.stat().st_size for file in out.rglob("*") if file.is_file()) / 1e6
    nodes = sum(level["nodes"] for level in report["levels"])
    shutil.rmtree(out)
    return seconds, measuring, megabytes, nodes


if __name__ == "__main__":
    main()
