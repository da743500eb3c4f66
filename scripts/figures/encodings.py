"""Measures encodings of node files; see scripts/encodings."""

import resource
import shutil
import subprocess

from common import DOCS, Options, Programs, machine, real_data, run, say, table, write_between_markers

ENCODINGS = [
    ("plain", []),
    ("`--compress meshopt`", ["--compress", "meshopt"]),
    ("`--quantize 0.01`", ["--quantize", "0.01"]),
    ("both", ["--quantize", "0.01", "--compress", "meshopt"]),
]


def main():
    runs = ("the fastest of how many runs", 3)
    arguments = Options("encodings", __doc__, runs=runs, real=True).parse()
    programs = Programs(examples=["load_nodes"])
    size = {"blocks": 12, "triangles": 300_000}
    inputs = [("generated city, textured", [programs.city("encodings", **size)])]
    plain = programs.city("encodings-plain", **size, no_textures=True)
    inputs.append(("generated city, plain", [plain]))
    if not arguments.no_real:
        names = ("oblique_a", "ingolstadt", "hamada")
        inputs += [(f"`{name}`", real_data(name)) for name in names]
    rows = []
    for name, models in inputs:
        if models:
            rows += measure(programs, name, models, arguments.runs)
    head = ["", "", "nodes, MB", "of it geometry", "source, MB", "build, s", "load, ms"]
    text = (
        machine()
        + "\n\nProcessor seconds to build; milliseconds to read all nodes on one thread, textures"
        + " not decoded; source is the model with its textures.\n\n"
        + table(head, rows)
    )
    print(text)
    if arguments.write:
        write_between_markers(DOCS / "encodings.md", "encodings", text)


def measure(programs, name, models, runs):
    out = programs.work / "encodings-out"
    source = source_bytes(models)
    for encoding, options in ENCODINGS:
        say(f"{name}, {encoding}")
        spent = float("inf")
        for _ in range(runs):
            shutil.rmtree(out, ignore_errors=True)
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            command = [programs.path("hlod-build"), "--quiet", "--threads", "1", *options]
            run([*command, *map(str, models), str(out)])
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            work = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            spent = min(spent, work)
        command = [programs.path("examples/load_nodes"), str(2 * runs), str(out)]
        nodes, textures, load = subprocess.check_output(command, text=True).split()
        geometry = int(nodes) - int(textures)
        yield [
            name,
            encoding,
            megabytes(int(nodes)),
            megabytes(geometry),
            megabytes(source),
            f"{spent:.2f}",
            f"{float(load) * 1e3:.1f}",
        ]
    shutil.rmtree(out, ignore_errors=True)


def source_bytes(models):
    """Bytes of the models with all textures and material files beside them."""
    kinds = (".obj", ".mtl", ".glb", ".jpg", ".png")
    files = {
        file
        for model in models
        for file in model.parent.rglob("*")
        if file.suffix.lower() in kinds
    }
    return sum(file.stat().st_size for file in files)


def megabytes(count):
    return f"{count / 1e6:.2f}"


if __name__ == "__main__":
    main()
