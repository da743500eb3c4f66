"""Replays walks and drives with and without cells; see scripts/cells."""

import csv
import json
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
# (pixels along the side of a face, metres from a cell to its cull box)
FACES = [(512, 120)]
# What a machine adds by chance: by the model clock, with lavapipe's prices.
CLOCK = ["--clock", "model", "--seed", "1"]


def main():
    arguments = Options("cells", __doc__, quick="a few frames of one scene", real=True).parse()
    programs = Programs(features=True)
    frames = 60 if arguments.quick else FRAMES
    kinds = KINDS[:1] if arguments.quick else KINDS
    names = [] if arguments.quick or arguments.no_real else REAL
    scenes = [("city", [programs.city("cells-city", **CITY)])]
    scenes += [(name, models) for name in names if (models := real_data(name))]
    made, drawn = [], []
    for name, models in scenes:
        out = programs.work / f"scene-cells-{name}"
        run([programs.path("hlod-build"), "--quiet", *map(str, models), str(out)])
        paths = {kind: path(programs, out, kind, frames) for kind in kinds}
        alone = {at: replay(programs, out, paths[at[0]], at[1], "off") for at in points(kinds)}
        for pixels, cull in FACES[:1] if arguments.quick else FACES:
            what = f"{name}, {pixels} pixels, {cull} m"
            say(what)
            made.append([what, *prepare(programs, out, paths.values(), pixels, cull)])
            for kind, target in points(kinds):
                with_cells = replay(programs, out, paths[kind], target, "cells")
                drawn.append([f"{what}: {kind}, {target} ms", *compared(alone[kind, target], with_cells)])
    text = machine() + "\n\n" + tables(made, drawn, frames)
    print(text)
    if arguments.write:
        write_between_markers(DOCS / "cells.md", "cells", text)


def points(kinds):
    return [(kind, target) for kind in kinds for target in TARGETS_MS]


def path(programs, out, kind, frames):
    file = programs.work / f"{out.name}-{kind}.csv"
    run([programs.path("hlod-bench"), "make-path", str(out), "--kind", kind]
        + ["--frames", str(frames), "--out", str(file)])
    return file


def prepare(programs, out, paths, pixels, cull):
    """Cells a minute, faces, triangles and bytes of a face, and its share of the scene's bytes."""
    shutil.rmtree(out / "cells", ignore_errors=True)
    (out / "cells.hlod").unlink(missing_ok=True)
    begin = time.monotonic()
    command = [programs.path("hlod-build"), "cells", str(out), "--along", *map(str, paths)]
    text = subprocess.check_output([*command, "--pixels", str(pixels), "--cull", str(cull)], text=True)
    seconds = time.monotonic() - begin
    cells = int(text.split()[0])
    files = list((out / "cells").glob("*.glb"))
    size = sum(file.stat().st_size for file in files)
    triangles = int(text.split("faces: ")[1].split()[0])
    return [
        str(cells),
        f"{60 * cells / seconds:.0f}",
        f"{len(files) / cells:.1f}",
        f"{triangles:,}",
        f"{size / len(files) / 1e3:.0f}",
    ]


def replay(programs, out, path, target, far_field):
    result = programs.work / "cells-run"
    run([programs.path("hlod-bench"), str(out), str(path), *CLOCK, "--quiet"]
        + ["--target-ms", str(target), "--warm-up-frames", str(SETTLE)]
        + ["--reference-every", str(EVERY), "--far-field", far_field, "--out", str(result)])
    with open(result / "frames.csv", newline="") as file:
        frames = list(csv.DictReader(file))
    summary = json.loads((result / "summary.json").read_text())
    looked = [frame for frame in frames if frame["flip_mean"]]
    times = sorted(float(frame["frame_ms"]) for frame in frames)

    def mean(name, of=frames):
        return sum(float(frame[name]) for frame in of) / len(of)

    return {
        "p95": times[int(0.95 * len(times))],
        "triangles": mean("triangles") + mean("face_triangles"),
        "flip": mean("flip_mean", looked),
        "gaps": sum(int(frame["inner_gap_pixels"]) for frame in looked)
        / max(1, sum(int(frame["reference_pixels"]) for frame in looked)),
        "memory": max(float(frame["memory_bytes"]) for frame in frames),
        "frames": summary["far_field"]["frames_percent"],
    }


def compared(alone, with_cells):
    def both(name, form):
        return f"{form(alone[name])} / {form(with_cells[name])}"

    return [
        f"{with_cells['frames']:.0f}",
        both("p95", "{:.1f}".format),
        both("triangles", lambda number: f"{number / 1e3:.1f}"),
        both("flip", "{:.4f}".format),
        both("gaps", lambda part: f"{1e6 * part:.0f}"),
        both("memory", lambda size: f"{size / 2**20:.0f}"),
    ]


def tables(made, drawn, frames):
    head = ["cells", "number", "a minute", "faces each", "triangles a face", "KB a face"]
    of_runs = ["run", "% of frames", "ms, p95", "thousand triangles", "FLIP", "gaps, millionths", "MiB"]
    return (
        "Made along a walk and a drive, cells of 4 m:\n\n"
        + table(head, made)
        + f"\nThe default policy over {frames} frames, by the model clock, 1280 × 720; *hierarchy alone / with "
        "cells*, and in how many frames a cell was there. Gaps are pixels with background where the leaves have surface that no outline explains:\n\n"
        + table(of_runs, drawn)
    )


if __name__ == "__main__":
    sys.exit(main())
