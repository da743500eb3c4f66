"""Draws level 0 of real meshes beside their source; see scripts/levels."""

import json
import shutil
import subprocess

from common import DOCS, Options, Programs, real_data, run, say, write_between_markers

# Folder of the real data and where to look at it from, if not from above its south.
SETS = {
    "sceaux": ["--fov", "28"],
    "oblique_a": ["--fov", "36"],
    "ingolstadt": ["--fov", "36"],
    "torcs_street1": ["--fov", "40"],
    "hamada": ["--fov", "36"],
    "wageningen": ["--fov", "36"],
    "lyon_roads": ["--fov", "36"],
    "3dfier": ["--fov", "36"],
}
SIZE = "480x360"
PAGE = DOCS / "levels.md"


def main():
    options = Options("levels", __doc__)
    options.add_argument("--sets", nargs="+", choices=SETS, default=list(SETS), help="[all]")
    arguments = options.parse()
    programs = Programs(examples=["render_scene", "tile_pictures"], features=True)
    for name in arguments.sets:
        if models := real_data(name):
            say(name)
            text = section(programs, name, models, arguments.write)
            print(text)
            if arguments.write:
                write_between_markers(PAGE, name, text)


def section(programs, name, models, write):
    out = programs.work / "levels-out"
    shutil.rmtree(out, ignore_errors=True)
    run([programs.path("hlod-build"), "--quiet", *map(str, models), str(out)])
    report = json.loads((out / "build.json").read_text())
    command = [programs.path("hlod-build"), "verify", "--quiet", "--json", str(out)]
    done = subprocess.run(command, stdout=subprocess.PIPE)
    if done.returncode not in (0, 3):
        raise SystemExit(f"exit code {done.returncode} from {' '.join(command)}")
    level = json.loads(done.stdout)["levels"][0]
    folder = DOCS / "levels" if write else programs.work
    folder.mkdir(exist_ok=True)
    pictures = [programs.work / f"levels-{side}.png" for side in ("coarse", "source")]
    for picture, front in zip(pictures, (["--level", "0"], ["--leaves"])):
        command = [programs.path("examples/render_scene"), str(out), str(picture), *front]
        command += ["--size", SIZE, *SETS[name]]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    run([programs.path("examples/tile_pictures"), str(folder / f"{name}.jpg"), *map(str, pictures)])
    shutil.rmtree(out)
    return f"{caption(report, level)}\n\n![{name}: level 0 and the source](levels/{name}.jpg)\n"


def caption(report, level):
    source = report["source_triangles"]
    nodes = report["levels"][0]["nodes"]
    parts = [
        f"{level['triangles']:,} of {source:,} triangles in {nodes} nodes",
        f"RMS distance {level['two_sided']['rms_relative']:.1f}e-4 of the diagonal",
    ]
    if level["color_rms"] is not None:
        parts.append(f"colours off by {level['color_rms']:.1f} of 255 (RMS)")
    if report["source_texels"]:
        texels = sum(level["texels"] for level in report["levels"])
        parts.append(f"texels of all levels {texels / report['source_texels']:.2f} times the source's")
    baked = sum(level["nodes"] for level in report["levels"][:-1])
    parts.append(f"{len(report['baked'])} of {baked} coarse nodes with baked textures")
    return "; ".join(parts) + "."


if __name__ == "__main__":
    main()
