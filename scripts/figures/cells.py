"""Replays walks and drives with and without cells; see scripts/cells."""

import base64
import csv
import json
import re
import shutil
import subprocess
import sys
import time

from common import DOCS, Options, Programs, machine, real_data, run, say, table, write_between_markers

# One million triangles in 70 blocks, as in the other pages.
CITY = {"blocks": 70, "triangles": 1_000_000, "texels_per_triangle": 17}
REAL = ["hamada", "ingolstadt"]
KINDS = ["walk", "drive"]
TARGETS_MS = [30, 10]
FRAMES, SETTLE, EVERY = 300, 100, 15
# Triangles of what is near in a view, by which cull boxes are chosen: the default.
NEAR = [50_000]
WAYS = ["off", "cells", "auto"]
# Where eyes are in no cell, but for the beginning of a flight.
ELSEWHERE = ["fly", "rise"]
# Policies that are compared with and without cells.
POLICIES = ["gain-over-price", "best-first", "lakhia"]
# What the paper's system held of its model, and is allowed of all that a scene takes in memory; more where that would be
# less than so many times what its roots take, which are always held.
PART_IN_MEMORY = 0.11
ROOTS = 2
# Streets of which pictures are shown: the first frame of a walk, at a target in milliseconds.
PICTURES = {"city": 30, "hamada": 10}
# Pictures in a report.
JPEG = r"data:image/jpeg;base64,([A-Za-z0-9+/=]+)"
# What a machine adds by chance: by the model clock, with lavapipe's prices.
CLOCK = ["--clock", "model", "--seed", "1"]


def main():
    arguments = Options("cells", __doc__, quick="a few frames of one scene", real=True).parse()
    # Before any picture is written again.
    made_on = machine()
    programs = Programs(examples=["tile_pictures"], features=True)
    frames = 60 if arguments.quick else FRAMES
    kinds = KINDS[:1] if arguments.quick else KINDS
    names = [] if arguments.quick or arguments.no_real else REAL
    scenes = [("city", [programs.city("cells-city", **CITY)])]
    scenes += [(name, models) for name in names if (models := real_data(name))]
    made, drawn, elsewhere, capped, pictures, policies = [], [], [], [], [], []
    for name, models in scenes:
        out = programs.work / f"scene-cells-{name}"
        run([programs.path("hlod-build"), "--quiet", *map(str, models), str(out)])
        paths = {kind: path(programs, out, kind, frames) for kind in kinds}
        alone = {at: replay(programs, out, paths[at[0]], at[1], "off", pops=pops(at)) for at in points(kinds)}
        for near in NEAR[:1] if arguments.quick else NEAR:
            what = f"{name}, {near:,}"
            say(what)
            made.append([what, *prepare(programs, out, paths.values(), near)])
            for at in points(kinds):
                ways = {"cells": replay(programs, out, paths[at[0]], at[1], "cells", pops=pops(at))}
                ways["auto"] = replay(programs, out, paths[at[0]], at[1], "auto")
                of_run = f"{what}: {at[0]}, {at[1]} ms"
                drawn.append([of_run, *compared({"off": alone[at], **ways})])
        target = TARGETS_MS[0]
        for kind in [] if arguments.quick else ELSEWHERE:
            route = path(programs, out, kind, frames)
            ways = [replay(programs, out, route, target, way) for way in WAYS]
            elsewhere.append([f"{name}: {kind}, {target} ms", *beside(ways)])
        for kind in kinds:
            scene, roots = (alone[kind, target][name] for name in ["scene", "roots"])
            cap = int(max(PART_IN_MEMORY * scene, ROOTS * roots))
            ways = [replay(programs, out, paths[kind], target, way, cap=cap) for way in WAYS]
            capped.append([f"{name}: {kind}, {target} ms", f"{cap / 2**20:.0f} of {scene / 2**20:.0f}", *held(ways)])
        if name == "city" and not arguments.quick:
            policies = by_policy(programs, out, frames)
        if name in PICTURES and arguments.write:
            pictures.append(street(programs, out, name, paths["walk"]))
    text = "\n\n".join([made_on, tables(made, drawn, elsewhere, capped, policies, frames), *pictures]) + "\n"
    print(text)
    if arguments.write:
        write_between_markers(DOCS / "cells.md", "cells", text)


def pops(at):
    """Changes are looked at along walks at the first target: every one is drawn three times."""
    return ["--pops"] if at == (KINDS[0], TARGETS_MS[0]) else []


def points(kinds):
    return [(kind, target) for kind in kinds for target in TARGETS_MS]


def path(programs, out, kind, frames):
    file = programs.work / f"{out.name}-{kind}.csv"
    run([programs.path("hlod-bench"), "make-path", str(out), "--kind", kind]
        + ["--frames", str(frames), "--out", str(file)])
    return file


def prepare(programs, out, paths, near):
    """Number of cells, metres to the sides of their cull boxes, cells a minute, faces, triangles and KB of a face, and
    what is missing and wrong as seen from corners that no picture was taken from."""
    shutil.rmtree(out / "cells", ignore_errors=True)
    (out / "cells.hlod").unlink(missing_ok=True)
    begin = time.monotonic()
    command = [programs.path("hlod-build"), "cells", str(out), "--along", *map(str, paths)]
    text = subprocess.check_output([*command, "--triangles", str(near)], text=True)
    seconds = time.monotonic() - begin
    cells = int(text.split()[0])
    files = list((out / "cells").glob("*.glb"))
    size = sum(file.stat().st_size for file in files)
    triangles = int(text.split("faces: ")[1].split()[0])
    least, most = re.search(r"cull boxes of (?:(\d+) to )?(\d+) m", text).groups()
    return [
        str(cells),
        f"{least}–{most}" if least else most,
        f"{60 * cells / seconds:.0f}",
        f"{len(files) / cells:.1f}",
        f"{triangles:,}",
        f"{size / len(files) / 1e3:.0f}",
        unseen(programs, out),
    ]


def unseen(programs, out):
    """Percent of what is far that is missing, and that is wrong, from corners that no picture was taken from."""
    command = [programs.path("hlod-build"), "verify", str(out), "--json", "--quiet", "--samples", "1000"]
    text = subprocess.run(command, stdout=subprocess.PIPE, text=True).stdout
    cells = json.loads(text)["cells"]

    def part(name):
        return 100 * sum(cell[name] for cell in cells) / sum(cell["pixels"] for cell in cells)

    return f"{part('missing'):.2f} / {part('wrong'):.2f}"


def replay(programs, out, path, target, far_field, every=EVERY, pops=(), cap=None):
    result = programs.work / f"cells-run-{far_field}"
    run([programs.path("hlod-bench"), str(out), str(path), *CLOCK, "--quiet"]
        + ["--target-ms", str(target), "--warm-up-frames", str(SETTLE), *pops]
        + ([] if cap is None else ["--max-memory", str(cap)])
        + ["--reference-every", str(every), "--far-field", far_field, "--out", str(result)])
    with open(result / "frames.csv", newline="") as file:
        frames = list(csv.DictReader(file))
    summary = json.loads((result / "summary.json").read_text())
    looked = [frame for frame in frames[::every] if frame["flip_mean"]]
    times = sorted(float(frame["frame_ms"]) for frame in frames)

    def mean(name, of=frames):
        return sum(float(frame[name]) for frame in of) / len(of)

    def drawn(of):
        return mean("triangles", of) + mean("face_triangles", of)

    def pop(far):
        if not pops:
            return None
        of = [float(frame["pop_flip"]) for frame in frames if frame["pop_flip"] and frame["far_changed"] == far]
        return sum(of) / len(of) if of else None

    return {
        "p95": times[int(0.95 * len(times))],
        "triangles": drawn(frames),
        "part": drawn(looked) / mean("reference_triangles", looked),
        "flip": mean("flip_mean", looked),
        "gaps": sum(int(frame["inner_gap_pixels"]) for frame in looked)
        / max(1, sum(int(frame["reference_pixels"]) for frame in looked)),
        "scene": summary["memory"]["scene_bytes"],
        "roots": summary["memory"]["start_bytes"],
        "reread": sum(float(frame["reread_bytes"]) for frame in frames),
        "lacking": summary["loading"]["lacking_percent"],
        "memory": max(float(frame["memory_bytes"]) for frame in frames),
        "frames": summary["far_field"]["frames_percent"],
        "toggle": pop("0"),
        "change": pop("1"),
    }


def compared(ways):
    def of(name, form):
        return " / ".join(form(ways[way][name]) for way in WAYS)

    def pop(value):
        return "–" if value is None else f"{value:.4f}"

    return [
        f"{ways['cells']['frames']:.0f} / {ways['auto']['frames']:.0f}",
        of("p95", "{:.1f}".format),
        of("triangles", lambda number: f"{number / 1e3:.1f}"),
        of("part", lambda part: f"{100 * part:.1f}"),
        of("flip", "{:.4f}".format),
        of("gaps", lambda part: f"{1e6 * part:.0f}"),
        of("memory", lambda size: f"{size / 2**20:.0f}"),
        f"{pop(ways['off']['toggle'])} / {pop(ways['cells']['change'])}",
    ]


def beside(ways):
    """Of runs by each way."""
    def of(name, form):
        return " / ".join(form(way[name]) for way in ways)

    return [
        " / ".join(f"{way['frames']:.0f}" for way in ways[1:]),
        of("p95", "{:.1f}".format),
        of("flip", "{:.4f}".format),
    ]


def held(ways):
    """Of runs by each way under a cap."""
    def of(name, form):
        return " / ".join(form(way[name]) for way in ways)

    return [
        *beside(ways),
        of("lacking", "{:.1f}".format),
        of("memory", lambda size: f"{size / 2**20:.0f}"),
        of("reread", lambda size: f"{size / 1e6:.1f}"),
    ]


def by_policy(programs, out, frames):
    """Rows of `hlod-bench policies` over the walk and the drive for which cells were made."""
    result = programs.work / "cells-policies"
    run([programs.path("hlod-bench"), "policies", str(out), "--with-cells", "--policy", ",".join(POLICIES)]
        + ["--paths", ",".join(KINDS), "--seeds", "1", "--targets", str(TARGETS_MS[0]), "--frames", str(frames)]
        + ["--warm-up-frames", str(SETTLE), "--reference-every", str(EVERY), "--out", str(result)])
    with open(result / "policies.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["policy"] != "oracle"]

    def both(policy, name, form):
        of = {row["path"]: float(row[name]) for row in rows if row["policy"] == policy}
        return " / ".join(form(of[kind]) for kind in KINDS)

    return [
        [
            policy,
            both(policy, "flip_mean", "{:.4f}".format),
            both(policy, "frame_ms_p95", "{:.1f}".format),
            both(policy, "late_percent", "{:.1f}".format),
            both(policy, "toggles_per_min", "{:.0f}".format),
            both(policy, "peak_mb", "{:.0f}".format),
        ]
        for policy in dict.fromkeys(row["policy"] for row in rows)
    ]


def street(programs, out, name, path):
    """The first frame of a walk by the hierarchy alone, with cells, and of the leaves, as one picture."""
    target = PICTURES[name]
    shown = []
    for way in ["off", "cells"]:
        # No other frame is looked at.
        replay(programs, out, path, target, way, every=FRAMES)
        report = (programs.work / f"cells-run-{way}" / "report.html").read_text()
        shown.append([base64.b64decode(text) for text in re.findall(JPEG, report)[:2]])
    (alone, leaves), (with_cells, _) = shown
    files = []
    for number, jpeg in enumerate([alone, with_cells, leaves]):
        files.append(programs.work / f"cells-street-{number}.jpg")
        files[-1].write_bytes(jpeg)
    (DOCS / "cells").mkdir(exist_ok=True)
    run([programs.path("examples/tile_pictures"), str(DOCS / "cells" / f"{name}.jpg"), *map(str, files)])
    caption = f"{name}, {target} ms: the hierarchy alone, with cells, and all leaves"
    return f"![{caption}](cells/{name}.jpg)\n\n*{caption}.*"


def tables(made, drawn, elsewhere, capped, policies, frames):
    head = ["cells", "number", "m to the box", "a minute", "faces each", "triangles a face", "KB a face"]
    head += ["% missing / wrong"]
    of_runs = ["run", "% of frames", "ms, p95", "thousand triangles", "% of those in the frustum"]
    of_any = ["run", "% of frames", "ms, p95", "FLIP"]
    of_policies = ["policy", "FLIP", "ms, p95", "late, %", "toggles a minute", "peak, MB"]
    under_cap = ["run", "cap of scene, MiB", *of_any[1:], "% of frames lack a node", "MiB", "MB read again"]
    of_runs += ["FLIP", "gaps, millionths", "MiB", "toggle / change of cell, FLIP"]
    return (
        "Made along a walk and a drive, cells of 4 m, faces of 512 pixels; *cells* are named by the triangles of what is "
        "near in a view, by which cull boxes are chosen (`--triangles`):\n\n"
        + table(head, made)
        + "\n*Missing* and *wrong* are parts of what is far, as seen from corners of cells that no picture was taken "
        "from (`hlod-build verify`).\n"
        + f"\nThe default policy over {frames} frames, by the model clock, 1280 × 720: *`--far-field off` / `cells` / "
        "`auto`*, and in how many frames a cell was drawn by the last two. *Those in the frustum* are the source's "
        "triangles. Gaps are pixels with background where the leaves have surface that no outline explains. Changes are "
        "means over frames in which levels toggled (`off`), and in which the cell changed (`cells`), on walks at 30 ms:\n\n"
        + table(of_runs, drawn)
        + (f"\nFlights, whose eyes are in no cell but at their beginning, and rises:\n\n{table(of_any, elsewhere)}" if elsewhere else "")
        + f"\nUnder a cap of {100 * PART_IN_MEMORY:.0f} % of what all of the scene takes in memory, or {ROOTS} times what its "
        "roots take where that is more; a frame that lacks a "
        "node would have drawn it in place of a coarser one:\n\n"
        + table(under_cap, capped)
        + (f"\nOther policies with cells, by `hlod-bench policies --with-cells` in the city at {TARGETS_MS[0]} ms, *"
           f"{' / '.join(KINDS)}*:\n\n{table(of_policies, policies)}" if policies else "")
    ).strip()


if __name__ == "__main__":
    sys.exit(main())
