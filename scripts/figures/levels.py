"""Draws level 0 of real meshes and of a generated track beside their source, from two distances; see scripts/levels."""

import json
import shutil
import subprocess

import race_track
from common import DOCS, REAL, Options, Programs, real_data, run, say, table, write_between_markers

PAGE = DOCS / "levels.md"
TRACK = "race_track"


def main():
    options = Options("levels", __doc__)
    sets = [*REAL, TRACK]
    options.add_argument("--sets", nargs="+", choices=sets, default=sets, help="[all]")
    arguments = options.parse()
    examples = ["level_views", "tile_pictures"]
    programs = Programs(examples=examples, features=True)
    for name in arguments.sets:
        if models := models_of(programs, name):
            say(name)
            text = section(programs, name, models, arguments.write)
            print(text)
            if arguments.write:
                write_between_markers(PAGE, name, text)


def models_of(programs, name):
    """Model files of a set: of the real data, or the generated track."""
    if name != TRACK:
        return real_data(name)
    return [race_track.write(programs.work / TRACK)]


def section(programs, name, models, write):
    out = programs.work / "levels-out"
    shutil.rmtree(out, ignore_errors=True)
    run([programs.path("hlod-build"), "--quiet", *map(str, models), str(out)])
    report = json.loads((out / "build.json").read_text())
    command = [programs.path("hlod-build"), "verify", "--quiet", "--json", str(out)]
    done = subprocess.run(command, stdout=subprocess.PIPE)
    if done.returncode not in (0, 3):
        raise SystemExit(f"exit code {done.returncode} from {' '.join(command)}")
    levels = json.loads(done.stdout)["levels"]
    pictures = programs.work / "levels-pictures"
    shutil.rmtree(pictures, ignore_errors=True)
    command = [programs.path("examples/level_views"), str(out), "--pictures", str(pictures)]
    views = json.loads(subprocess.check_output(command))["levels"]
    folder = DOCS / "levels" if write else programs.work
    folder.mkdir(exist_ok=True)
    shown = [pictures / of / f"{view}.png" for view in ("far", "quarter") for of in ("level0", "leaves")]
    run([programs.path("examples/tile_pictures"), str(folder / f"{name}.jpg"), *map(str, shown)])
    shutil.rmtree(out)
    rows = [row(*level) for level in zip(levels, views)]
    picture = f"![{name}: level 0 and the source](levels/{name}.jpg)"
    return f"{caption(report)}\n\n{table(HEAD, rows)}\n{picture}\n"


HEAD = ["level", "triangles", "RMS, e-4", "largest, m", "ground", "skyline", "colour", "near", "far"]


def row(level, views):
    distance, kept = level["two_sided"], level["kept"]
    percent = lambda share: "–" if share is None else f"{share:.1%}"
    color = level["color_rms"]
    return [
        f"{level['level']}",
        f"{level['triangles']:,}",
        f"{distance['rms_relative']:.1f}",
        f"{distance['max']:.3g}",
        percent(kept["area"]),
        percent(kept["skyline"]),
        "–" if color is None else f"{color:.1f}",
        f"{views['near']:.4f}",
        f"{views['far']:.4f}",
    ]


def caption(report):
    source = report["source_triangles"]
    nodes = report["levels"][0]["nodes"]
    parts = [f"{source:,} triangles, {nodes} nodes on level 0"]
    if report["source_texels"]:
        texels = sum(level["texels"] for level in report["levels"])
        parts.append(f"texels of all levels {texels / report['source_texels']:.2f} times the source's")
    baked = sum(level["nodes"] for level in report["levels"][:-1])
    parts.append(f"{len(report['baked'])} of {baked} coarse nodes with baked textures")
    return "; ".join(parts) + "."


if __name__ == "__main__":
    main()
