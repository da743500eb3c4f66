"""Measures hlod-build; see scripts/bench-build."""

import os
import re
import shutil
import statistics
import subprocess

from common import (
    DOCS,
    ROOT,
    Options,
    REAL,
    Programs,
    machine,
    quantity,
    real_data,
    say,
    table,
    texels_written,
    write_between_markers,
)
from disk import bandwidth

# Of the generated cities: as in Cozzi & Loo's, 5.6 M triangles in 70 blocks.
TRIANGLES_PER_BLOCK = 80_000
TEXELS = 17
# Of the thesis's data.
THESIS_TEXELS = 105
# As scans have them: hundreds of torn charts a block.
TORN_TRIANGLES_PER_BLOCK = 16_000
TORN_TEXELS = 1000
TORN = "city of torn charts"
# As cities come that are larger than memory: files, and what a build may hold.
LARGE_BLOCKS = 400
LARGE_TRIANGLES = 64_000_000
LARGE_MEMORY = "1GiB"
# What textures add is measured on these, and on generated cities of as many texels as those above.
SCANS = ["sceaux", "oblique_b"]
STAGES = ["compare", "import", "gather", "pictures", "cut", "simplify", "measure"]
STAGES += ["bake", "atlas", "write"]


def main():
    arguments = parse()
    programs = Programs(examples=["jpeg_alone"])
    threads = sorted({1, os.cpu_count()})
    runs = measure_all(programs, arguments, threads)
    cities = [run for run in runs if run["texels"]]
    findings = [scaling(runs, threads), jpeg_table(programs, arguments, runs)]
    about = [machine(), conditions(arguments)]
    disk = disk_table(programs, [run for run in runs if run["threads"] == threads[-1]])
    full = paragraphs(about + [main_table(runs), disk, stage_table(runs)] + findings)
    print(full)
    if arguments.write:
        write_between_markers(DOCS / "benchmarks.md", "figures", full)
        short = paragraphs([summary_table(cities), about[0]])
        write_between_markers(ROOT / "README.md", "summary", short)


def paragraphs(parts):
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def parse():
    quick = "0.2 M triangles, one run"
    runs = ("the median of how many runs", 3)
    options = Options("bench-build", __doc__, quick, runs, real=True)
    options.add_argument(
        "--no-large",
        dest="large",
        action="store_false",
        help=f"without {LARGE_TRIANGLES / 1e6:g} M triangles, which take 8 GB of disk",
    )
    arguments = options.parse()
    if arguments.quick:
        arguments.runs, arguments.large = 1, False
    return arguments


def measure_all(programs, arguments, threads):
    """For each input and number of threads: its name, its texels and its median run."""
    sizes = [200_000] if arguments.quick else [1_000_000, 4_000_000, 8_000_000]
    cities = [(size, TEXELS) for size in sizes] + [(sizes[0], THESIS_TEXELS)]
    inputs = []
    for size, texels in cities:
        city = programs.city(
            f"city-{size}-{texels}",
            blocks=max(1, round(size / TRIANGLES_PER_BLOCK)),
            triangles=size,
            texels_per_triangle=texels,
        )
        inputs.append((f"city, {size / 1e6:g} M, {texels} texels", size, texels, [city]))
    blocks, charts = (1, 100) if arguments.quick else (6, 300)
    size = blocks * TORN_TRIANGLES_PER_BLOCK
    torn = programs.city(
        f"city-torn-{blocks}",
        blocks=blocks,
        triangles=size,
        texels_per_triangle=TORN_TEXELS,
        charts=charts,
    )
    inputs.append((TORN, size, TORN_TEXELS, [torn]))
    if not arguments.no_real:
        names = REAL[:2] if arguments.quick else REAL
        inputs += [(name, None, None, models) for name in names if (models := real_data(name))]
    runs = []
    for name, size, texels, models in inputs:
        for count in threads:
            say(f"building {name} with {count} thread{'s' if count > 1 else ''}")
            runs.append(
                {"name": name, "size": size, "texels": texels, "threads": count, "models": models}
                | build(programs, arguments.runs, models, "--threads", count)
            )
    if arguments.large:
        runs.append(large(programs, threads[-1]))
    return runs


def large(programs, threads):
    """A city in files, of which only some are held at once."""
    size = LARGE_TRIANGLES
    options = {"texels_per_triangle": TEXELS, "split": True}
    city = programs.city("city-large", blocks=LARGE_BLOCKS, triangles=size, **options)
    name = f"city, {size / 1e6:g} M, {TEXELS} texels, {LARGE_BLOCKS} files"
    say(f"building {name}")
    told = {"name": name, "size": size, "texels": TEXELS, "threads": threads, "models": [city]}
    options = ["--threads", threads, "--max-memory", LARGE_MEMORY]
    return told | build(programs, 1, [city], *options)


def build(programs, runs, models, *options):
    """The median run, with the largest memory of all."""
    results = [programs.build(models, *options) for _ in range(runs)]
    results.sort(key=lambda result: result["seconds"])
    median = results[(len(results) - 1) // 2]
    median["peak_bytes"] = max(result["peak_bytes"] for result in results)
    return median


def conditions(arguments):
    return (
        f"Median of {arguments.runs} run{'s' if arguments.runs > 1 else ''} into an empty folder, "
        "default options, inputs in the page cache, wall time of the whole process; that of files "
        f"with `--max-memory {LARGE_MEMORY}`, and once. Peak memory is the most that the process held "
        "in any run. *Texels* is what was written on all levels against what the source's triangles use."
    )


def disk_table(programs, runs):
    """What is read and written, and how long the disk alone would take for it."""
    reading, writing = bandwidth(programs.work)
    rows = []
    for run in runs:
        report, written = run["report"], run["written"]
        read = sum(file["bytes"] for model in report["inputs"] for file in model["files"])
        seconds = read / reading + sum(written) / writing
        rows.append(
            [
                run["name"],
                f"{read / 1e6:.1f}",
                f"{sum(written) / 1e6:.1f}",
                f"{len(written):,}",
                str(len(report["levels"])),
                f"{seconds:.2f}",
                f"{100 * seconds / run['seconds']:.0f} %",
            ]
        )
    head = ["input", "MB read", "MB written", "files", "levels", "disk alone, s", "of the time"]
    return (
        f"What is read and written, and what the disk alone would take for it at {reading / 1e6:.0f} "
        f"MB/s and {writing / 1e6:.0f} MB/s, past the page cache:\n\n" + table(head, rows)
    )


def triangles(run):
    return run["report"]["source_triangles"]


HEAD = ["input", "threads", "triangles", "seconds", "triangles/s", "peak memory"]


def main_table(runs):
    return table([*HEAD, "bytes a triangle", "texels", "nodes"], rows_of(runs))


def rows_of(runs):
    rows = []
    for run in runs:
        report = run["report"]
        texels = texels_written(run) / report["source_texels"] if report["source_texels"] else None
        rows.append(
            [
                run["name"],
                str(run["threads"]),
                f"{triangles(run):,}",
                f"{run['seconds']:.2f}",
                quantity(triangles(run) / run["seconds"]),
                f"{run['peak_bytes'] / 1e6:.0f} MB",
                f"{run['peak_bytes'] / triangles(run):.0f}",
                f"{texels:.2f} ×" if texels else "–",
                f"{sum(level['nodes'] for level in report['levels']):,}",
            ]
        )
    return rows


def summary_table(runs):
    """The generated cities with all threads, in fewer columns: what the README shows."""
    most = max(run["threads"] for run in runs)
    return table(HEAD, [row[: len(HEAD)] for row in rows_of(runs) if row[1] == str(most)])


def stage_table(runs):
    rows = []
    for run in runs:
        seconds = {stage["stage"]: stage["seconds"] for stage in run["report"]["stages"]}
        row = [run["name"], str(run["threads"])]
        rows.append(row + [f"{seconds.get(stage, 0):.2f}" for stage in STAGES])
    head = "Seconds of work in each stage, summed over the threads:\n\n"
    return head + table(["input", "threads", *STAGES], rows)


def scaling(runs, threads):
    """What more threads and more triangles change."""
    lines = []
    cities = [run for run in runs if run["texels"] == TEXELS and run["size"] != LARGE_TRIANGLES]
    rates = {(run["size"], run["threads"]): triangles(run) / run["seconds"] for run in cities}
    sizes = sorted({run["size"] for run in cities})
    if len(threads) == 2:
        speedups = [f"{rates[size, threads[1]] / rates[size, 1]:.2f}" for size in sizes]
        named = ", ".join(f"{size / 1e6:g} M" for size in sizes)
        times = ", ".join(speedups)
        lines.append(f"- {threads[1]} threads against one, {named} triangles: {times} times as fast.")
    if len(sizes) > 1:
        small, large = rates[sizes[0], threads[-1]], rates[sizes[-1], threads[-1]]
        lines.append(
            f"- Triangles a second at {sizes[-1] / 1e6:g} M against {sizes[0] / 1e6:g} M: "
            f"{large / small:.2f} times."
        )
    return "\n".join(lines)


def jpeg_table(programs, arguments, runs):
    """What textures add to a build against decoding and encoding the same files and nothing else."""
    rows = []
    many = (THESIS_TEXELS, TORN_TEXELS)
    for run in (run for run in runs if run["texels"] in many or run["name"] in SCANS):
        say(f"textures of {run['name']} alone, and its mesh alone")
        pictures = run["models"][0].parent
        pictures = pictures / "city_textures" if run["size"] else pictures
        command = [programs.path("examples/jpeg_alone"), "--threads", str(run["threads"])]
        seconds, texels = [], 0
        for _ in range(arguments.runs):
            text = subprocess.check_output([*command, str(pictures)], text=True)
            found = re.fullmatch(r"(\d+) pictures, (\d+) texels, ([\d.]+) s\n", text)
            texels = int(found.group(2))
            seconds.append(float(found.group(3)))
        alone = statistics.median(seconds)
        bare = [untextured(programs, run["models"][0])]
        mesh = build(programs, arguments.runs, bare, "--threads", run["threads"])
        rows.append(
            [
                run["name"],
                str(run["threads"]),
                f"{texels / 1e6:.1f} M",
                f"{alone:.2f}",
                f"{run['seconds']:.2f}",
                f"{mesh['seconds']:.2f}",
                f"{(run['seconds'] - mesh['seconds']) / alone:.1f} ×",
            ]
        )
    head = ["input", "threads", "texels", "JPEG alone, s", "build, s", "without textures, s", "ratio"]
    text = (
        "What textures add, that is the build less that of the same mesh without its textures, "
        "against decoding and encoding their files by the same libraries, and nothing else:\n\n"
    )
    return text + table(head, rows)


def untextured(programs, model):
    """A copy of an OBJ whose materials have their colours only."""
    folder = programs.work / "untextured"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for material in model.parent.glob("*.mtl"):
        lines = material.read_text().splitlines(keepends=True)
        plain = (line for line in lines if not line.lstrip().startswith("map_"))
        (folder / material.name).write_text("".join(plain))
    return shutil.copy(model, folder / model.name)


if __name__ == "__main__":
    main()
