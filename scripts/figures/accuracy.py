"""Measures run time against error; see scripts/accuracy."""

import json
import math
import os
import resource
import shutil
import subprocess

from common import (
    DOCS,
    Options,
    Programs,
    machine,
    real_data,
    say,
    table,
    write_between_markers,
)

# Name and options of each way to build; the defaults first.
VARIANTS = [
    ("defaults", []),
    ("clustering", ["--simplifier", "clustering"]),
    ("borders locked", ["--borders", "locked"]),
    ("900 triangles a node", ["--desired-tris", "900"]),
    ("5,000 triangles a node", ["--desired-tris", "5000"]),
]
UTM = "678016,5403456,400"
# The share of the source's triangles at which ways are compared.
SHARE = 0.1
# Of the whole mesh in one piece: what a cut through a hierarchy is measured against.
WHOLE = ["--blocks", "grid:100000000", "--level-factor", "16"]


def main():
    arguments = parse()
    programs = Programs()
    parts = [machine(), conditions(arguments)]
    results, wholes = {}, []
    for title, models in inputs(programs, arguments):
        rows = {}
        for name, options in VARIANTS[:3] if arguments.quick else VARIANTS:
            say(f"{title}: {name}")
            rows[name] = measured(programs, models, options, arguments)
        results[title] = rows
        parts += [f"### {title}", variant_table(rows)]
        say(f"{title}: the whole in one piece")
        wholes.append([title, *against_whole(programs, title, models, rows["defaults"], arguments)])
    whole = whole_table(wholes)
    heights = height_field(programs, arguments)
    text = paragraphs(parts)
    short = paragraphs([whole, heights])
    print(text, short, sep="\n")
    if arguments.write:
        plot(results, DOCS / "accuracy.svg")
        write_between_markers(DOCS / "accuracy.md", "figures", text)
        write_between_markers(DOCS / "accuracy.md", "whole", short)


def parse():
    runs = ("the fastest of how many builds", 1)
    quick = "a tenth of the size, three ways"
    options = Options("accuracy", __doc__, quick, runs, real=True)
    options.add_argument("--samples", type=int, default=300_000, help="points of a surface [300000]")
    return options.parse()


def paragraphs(parts):
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def inputs(programs, arguments):
    if not arguments.no_real:
        for name in ["sceaux", "oblique_a", "hamada"]:
            if models := real_data(name):
                yield f"`{name}`", models
    size = 40_000 if arguments.quick else 400_000
    options = {"blocks": max(1, size // 80_000), "triangles": size}
    yield "generated city", [programs.city(f"accuracy-{size}", **options)]
    far = programs.city(f"accuracy-{size}-utm", **options, offset=UTM)
    yield f"the same at {UTM.replace(',', ', ')}", [far]


def conditions(arguments):
    return (
        f"One thread, processor seconds of the fastest of {arguments.runs} build{'s' if arguments.runs > 1 else ''}. "
        f"Errors are those of a front of at most {SHARE:.0%} of the source's triangles, chosen "
        "by the errors that viewers are given, two-sided and in units of 1e-4 of the diagonal of the bounding "
        f"box, by {arguments.samples:,} points spread over each surface (`hlod-build verify "
        f"--front {SHARE}`); *colour* is the RMS difference of 255 at the same points; *baking* is "
        "the part of the seconds that charts and textures of baked nodes took; *MB* is all that was "
        "written."
    )


def build(programs, models, options, arguments):
    """The fastest of several builds with one thread; the folder, and its seconds."""
    out = programs.work / f"accuracy-{os.getpid()}"
    seconds = math.inf
    for _ in range(arguments.runs):
        shutil.rmtree(out, ignore_errors=True)
        command = [programs.path("hlod-build"), "--quiet", "--threads", "1", *options]
        # What a thread worked, not what the clock showed: other programs may be running.
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([*command, *map(str, models), str(out)], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
        seconds = min(seconds, spent)
    return out, seconds, json.loads((out / "build.json").read_text())


def verified(programs, out, arguments, *options):
    command = [programs.path("hlod-build"), "verify", "--quiet", "--json", *options]
    command += ["--samples", str(arguments.samples), str(out)]
    done = subprocess.run(command, stdout=subprocess.PIPE)
    if done.returncode not in (0, 3):
        raise SystemExit(f"exit code {done.returncode} from {' '.join(command)}")
    return json.loads(done.stdout)


def measured(programs, models, options, arguments):
    out, seconds, report = build(programs, models, options, arguments)
    # Cutting divides triangles, so the leaves have more of them than the source.
    inspected = subprocess.check_output([programs.path("hlod-build"), "inspect", "--json", out])
    nodes = json.loads(inspected)["nodes"]
    leaves = sum(node["triangles"] for node in nodes if node["first_child"] is None)
    share = SHARE * report["source_triangles"] / leaves
    front = verified(programs, out, arguments, "--front", str(share))["front"]
    size = sum(file.stat().st_size for file in out.rglob("*") if file.is_file())
    shutil.rmtree(out)
    distance = front["two_sided"]
    return {
        "seconds": seconds,
        "rms": distance["rms_relative"],
        "max": distance["max_relative"],
        "color": front["color_rms"],
        "triangles": front["triangles"],
        "skirts": front["cut_plane_triangles"],
        "bake": {stage["stage"]: stage["seconds"] for stage in report["stages"]}["bake"],
        "bytes": size,
        "source": report["source_triangles"],
    }


def variant_table(rows):
    head = ["", "seconds", "baking", "triangles of the front", "RMS", "max", "colour", "MB"]
    cells = []
    for name, row in rows.items():
        color = "–" if row["color"] is None else f"{row['color']:.1f}"
        share = row["triangles"] / row["source"]
        cells.append(
            [name, f"{row['seconds']:.2f}", f"{row['bake']:.2f}"]
            + [f"{row['triangles']:,} ({share:.1%})"]
            + [f"{row['rms']:.3f}", f"{row['max']:.1f}", color, f"{row['bytes'] / 1e6:.1f}"]
        )
    return table(head, cells)


def against_whole(programs, title, models, row, arguments):
    """The defaults' front beside one simplification of the whole to as many triangles."""
    folder = programs.work / f"accuracy-whole-{os.getpid()}"
    moved = [beside_zero(model, folder / str(at)) for at, model in enumerate(models)]
    options = [*WHOLE, "--desired-tris", str(row["triangles"])]
    out, _, report = build(programs, moved, options, arguments)
    level = verified(programs, out, arguments)["levels"][0]
    shutil.rmtree(out)
    shutil.rmtree(folder)
    rms = level["two_sided"]["rms_relative"]
    return [
        f"{row['triangles']:,} ({row['skirts']:,} in skirts)",
        f"{row['rms']:.3f}",
        f"{level['triangles']:,}",
        f"{rms:.3f}",
        f"{row['rms'] / rms - 1:+.0%}",
    ]


def beside_zero(model, folder):
    """A copy of an OBJ on the positive side of all axes, so that one square of a grid holds it."""
    folder.mkdir(parents=True)
    for other in model.parent.iterdir():
        if other != model:
            (folder / other.name).symlink_to(other.resolve())
    corners = [tuple(map(float, line.split()[1:4])) for line in lines(model) if is_vertex(line)]
    low = [min(corner[axis] for corner in corners) for axis in range(3)]
    # A power of two keeps all digits.
    shift = [0 if x >= 0 else 2 ** math.ceil(math.log2(-x)) for x in low]
    if not any(shift):
        shutil.copy(model, folder)
        return folder / model.name
    with open(folder / model.name, "w") as out:
        for line in lines(model):
            if is_vertex(line):
                words = line.split()
                moved = [repr(float(word) + by) for word, by in zip(words[1:4], shift)]
                line = " ".join(["v", *moved, *words[4:]]) + "\n"
            out.write(line)
    return folder / model.name


def lines(model):
    with open(model, encoding="utf-8", errors="surrogateescape") as text:
        yield from text


def is_vertex(line):
    return line.startswith(("v ", "v\t"))


def whole_table(rows):
    head = ["", "front", "RMS", "the whole in one piece", "RMS", "front against whole"]
    text = (
        f"A front of {SHARE:.0%} of the triangles, skirts included, against one quadric "
        "simplification of the whole mesh, never cut, to as many triangles (RMS in 1e-4 of the "
        "diagonal, two-sided):\n\n"
    )
    return text + table(head, rows)


def height_field(programs, arguments):
    """A million triangles to a tenth, in one piece, by one thread."""
    side = 224 if arguments.quick else 708
    folder = programs.work / "height-field"
    folder.mkdir(exist_ok=True)
    model = folder / f"{side}.obj"
    if not model.is_file():
        model.write_text(heights(side))
    triangles = 2 * (side - 1) ** 2
    options = [*WHOLE, "--desired-tris", str(triangles // 10)]
    out, _, report = build(programs, [model], options, arguments)
    level = verified(programs, out, arguments)["levels"][0]
    shutil.rmtree(out)
    seconds = {stage["stage"]: stage["seconds"] for stage in report["stages"]}["simplify"]
    return (
        f"A generated height field of {triangles:,} triangles to {level['triangles']:,}, one "
        f"thread: {seconds:.2f} s to simplify, RMS {level['two_sided']['rms_relative']:.3f}e-4 of "
        f"the diagonal two-sided, {level['to_front']['rms_relative']:.3f}e-4 from the source."
    )


def heights(side):
    """Hills with some roughness: a grid of 1 m."""
    state = 1
    text = []
    for y in range(side):
        for x in range(side):
            state = (state * 1664525 + 1013904223) % 2**32
            z = 12 * math.sin(x / 37) * math.cos(y / 53) + 3 * math.sin(x / 7 + y / 11)
            text.append(f"v {x} {y} {z + state / 2**32 * 0.3:.4f}\n")
    for y in range(side - 1):
        for x in range(side - 1):
            a = y * side + x + 1
            text.append(f"f {a} {a + 1} {a + side + 1} {a + side}\n")
    return "".join(text)


def plot(results, file):
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "hlod"
    import matplotlib.pyplot as plt

    columns = 3
    rows = math.ceil(len(results) / columns)
    figure, axes = plt.subplots(rows, columns, figsize=(12, 4 * rows), squeeze=False)
    markers = "o^sPXDvd*"
    for axis, (title, ways) in zip(axes.flat, results.items()):
        for marker, (name, row) in zip(markers, ways.items()):
            axis.plot(row["seconds"], row["rms"], marker, label=name, markersize=8)
        axis.set(title=title.replace("`", ""), xlabel="seconds, one thread")
        axis.set_ylabel(f"RMS at {SHARE:.0%} of the triangles, 1e-4 of the diagonal")
        axis.set_xlim(left=0)
        axis.set_ylim(bottom=0)
    left = list(axes.flat)[len(results) :]
    for axis in left:
        axis.axis("off")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    (left or [figure])[0].legend(handles, labels, loc="center")
    figure.tight_layout()
    figure.savefig(file, metadata={"Date": None})


if __name__ == "__main__":
    main()
