"""Compares sizes of nodes; see scripts/node-size."""

import json
import os
import resource
import shutil
import subprocess

from common import DOCS, Options, Programs, machine, real_data, say, table, write_between_markers

SIZES = [900, 2_000, 5_000, 10_000]
PATHS = ["walk", "fly"]
# The share of the source's triangles that a front has.
SHARE = 0.1
FRAMES = 300
TARGET_MS = 30
# Pictures are compared with those of the leaves at every so many frames.
COMPARED_EVERY = 20
PICTURE = "640x360"


def main():
    arguments = Options("node-size", __doc__, "two sizes of one small city", real=True).parse()
    programs = Programs(features=True)
    sizes = SIZES[:2] if arguments.quick else SIZES
    rows = []
    for name, models in inputs(programs, arguments):
        paths = {}
        for size in sizes:
            say(f"{name}, {size} triangles a node")
            rows.append([name, f"{size:,}", *measured(programs, models, size, paths)])
        for path in paths.values():
            path.unlink()
    head = ["", "triangles", "seconds", "MB", "files", "nodes", "front, 1e-4"]
    head += [f"{kind}: {what}" for kind in PATHS for what in ("FLIP", "p95, ms", "MB read")]
    text = f"{machine()}\n\n{conditions()}\n\n{table(head, rows)}"
    print(text)
    if arguments.write:
        write_between_markers(DOCS / "node-size.md", "figures", text)


def conditions():
    return (
        "*Triangles* is `--desired-tris`; *seconds* are of one processor, for a build with one "
        "thread; *front* is the RMS distance, two-sided, in 1e-4 of the diagonal, of a front of at "
        f"most {SHARE:.0%} of the source's triangles chosen by the errors that viewers are given. A walk and a flight "
        f"of {FRAMES} frames are replayed by the model clock at {TARGET_MS} ms: the mean FLIP "
        f"against the leaves at every {COMPARED_EVERY}th frame, {PICTURE}; the frame time that 95 of "
        "100 frames keep; and what was read."
    )


def inputs(programs, arguments):
    triangles = 100_000 if arguments.quick else 1_000_000
    options = {"blocks": max(1, triangles // 60_000), "triangles": triangles}
    city = programs.city(f"node-size-{triangles}", **options, texels_per_triangle=17)
    yield f"city, {triangles:,}", [city]
    if not (arguments.quick or arguments.no_real):
        for name in ["hamada", "ingolstadt", "sceaux", "oblique_b"]:
            if models := real_data(name):
                yield f"`{name}`", models


def measured(programs, models, size, paths):
    work = programs.work
    out = work / f"node-size-{os.getpid()}"
    shutil.rmtree(out, ignore_errors=True)
    build = [programs.path("hlod-build"), "--quiet", "--threads", "1", "--desired-tris", str(size)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([*build, *map(str, models), str(out)], check=True)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    report = json.loads((out / "build.json").read_text())
    files = [file for file in out.rglob("*") if file.is_file()]
    megabytes = sum(file.stat().st_size for file in files) / 1e6
    nodes = inspected(programs, out)
    cells = [f"{seconds:.2f}", f"{megabytes:.1f}", f"{len(files):,}", f"{len(nodes):,}"]
    cells.append(f"{front(programs, out, nodes, report):.3f}")
    bench = programs.path("hlod-bench")
    for kind in PATHS:
        # All sizes are replayed along the path of the first.
        if kind not in paths:
            paths[kind] = work / f"node-size-{os.getpid()}-{kind}.csv"
            options = ["--kind", kind, "--frames", str(FRAMES), "--out", str(paths[kind])]
            quietly([bench, "make-path", str(out), *options])
        cells += replayed([bench, str(out), str(paths[kind])], work / f"node-size-run-{os.getpid()}")
    shutil.rmtree(out)
    return cells


def inspected(programs, out):
    command = [programs.path("hlod-build"), "inspect", "--json", str(out)]
    return json.loads(subprocess.check_output(command))["nodes"]


def front(programs, out, nodes, report):
    # Cutting divides triangles, so the leaves have more of them than the source.
    leaves = sum(node["triangles"] for node in nodes if node["first_child"] is None)
    share = SHARE * report["source_triangles"] / leaves
    command = [programs.path("hlod-build"), "verify", "--quiet", "--json"]
    command += ["--front", str(share), str(out)]
    done = subprocess.run(command, stdout=subprocess.PIPE)
    if done.returncode not in (0, 3):
        raise SystemExit(f"exit code {done.returncode} from {' '.join(command)}")
    return json.loads(done.stdout)["front"]["two_sided"]["rms_relative"]


def replayed(command, run):
    options = ["--clock", "model", "--target-ms", str(TARGET_MS), "--size", PICTURE]
    options += ["--reference-every", str(COMPARED_EVERY), "--out", str(run)]
    quietly([*command, *options])
    summary = json.loads((run / "summary.json").read_text())
    shutil.rmtree(run)
    read = summary["loading"]["read_bytes"] / 1e6
    flip = summary["accuracy"]["flip_mean"]["mean"]
    return [f"{flip:.4f}", f"{summary['frame_ms']['p95']:.1f}", f"{read:.1f}"]


def quietly(command):
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
