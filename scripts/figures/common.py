"""What the scripts that measure share: options, running the programs, tables, the machine."""

import argparse
import atexit
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
DOCS = ROOT / "docs"
DATA = Path(os.environ.get("HLOD_DATA", ROOT.parent / "shared" / "data"))

# Folders of the real data, each a city or a site.
REAL = [
    "sceaux",
    "oblique_a",
    "oblique_b",
    "ingolstadt",
    "torcs_street1",
    "hamada",
    "wageningen",
    "lyon_roads",
    "lyon_houses",
    "3dfier",
]


class Options(argparse.ArgumentParser):
    """The options of a script that writes its figures into the pages of docs/.

    `quick` says what --quick does: None where the script has no such option, `runs` what --runs
    counts and its default. With --quick nothing is written.
    """

    def __init__(self, prog, description, quick=None, runs=None, real=False):
        super().__init__(prog=prog, description=description)
        if runs:
            what, default = runs
            self.add_argument("--runs", type=int, default=default, help=f"{what} [{default}]")
        if quick:
            self.add_argument("--quick", action="store_true", help=f"{quick}, nothing written")
        if real:
            self.add_argument("--no-real", action="store_true", help="generated cities only")
        self.add_argument(
            "--no-write",
            dest="write",
            action="store_false",
            help="print only, leave documents as they are",
        )

    def parse(self):
        arguments = self.parse_args()
        if getattr(arguments, "runs", 1) < 1:
            self.error("--runs must be at least 1")
        if getattr(arguments, "quick", False):
            arguments.write = False
        return arguments


class Programs:
    """The programs in their release build, and a folder for what they make."""

    def __init__(self, examples=(), features=False, bins=True):
        command = ["cargo", "build", "--release", "--locked"]
        command += ["--bins"] if bins else []
        command += [] if features else ["--no-default-features"]
        command += [part for name in examples for part in ("--example", name)]
        subprocess.run(command, cwd=ROOT, check=True)
        text = subprocess.check_output(
            ["cargo", "metadata", "--no-deps", "--format-version", "1", "--locked"], cwd=ROOT
        )
        self.target = Path(json.loads(text)["target_directory"])
        self.work = self.target / "figures"
        self.work.mkdir(parents=True, exist_ok=True)

    def path(self, name):
        return str(self.target / "release" / name)

    def city(self, name, **options):
        """A generated city, made once for each set of options: a file, or a folder with `split`."""
        arguments = []
        for option, value in options.items():
            arguments.append("--" + option.replace("_", "-"))
            if value is not True:
                arguments.append(str(value))
        folder = self.work / name
        made = "city" if options.get("split") else "city.obj"
        made_with = folder / "made-with.txt"
        recipe = " ".join(arguments)
        if not made_with.is_file() or made_with.read_text() != recipe:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            say(f"generating {name}")
            run([self.path("make-city"), "--quiet", *arguments, str(folder / made)])
            made_with.write_text(recipe)
        return folder / made

    def build(self, inputs, *options):
        """Runs hlod-build into a new folder; returns what it took and what came out.

        The folders are removed at the very end: ext4 makes files slowly for some seconds after
        thousands were removed, and that would be measured instead.
        """
        self.outputs = getattr(self, "outputs", 0) + 1
        outputs = self.work / f"outputs-{os.getpid()}"
        if self.outputs == 1:
            outputs.mkdir()
            atexit.register(shutil.rmtree, outputs, ignore_errors=True)
        out = outputs / str(self.outputs)
        command = [self.path("hlod-build"), "--quiet", *map(str, options)]
        seconds = run([*command, *map(str, inputs), str(out)])
        report = json.loads((out / "build.json").read_text())
        scene = json.loads(
            subprocess.check_output([self.path("hlod-build"), "inspect", "--json", str(out)])
        )
        peak = report["peak_memory_bytes"]
        written = [path.stat().st_size for path in out.rglob("*") if path.is_file()]
        return {
            "seconds": seconds,
            "peak_bytes": peak,
            "report": report,
            "scene": scene,
            "written": written,
        }


def run(command):
    """Runs a program to its end: its wall time in seconds."""
    begin = time.monotonic()
    done = subprocess.run(command)
    seconds = time.monotonic() - begin
    if done.returncode != 0:
        sys.exit(f"exit code {done.returncode} from {' '.join(command)}")
    return seconds


def say(text):
    print(text, file=sys.stderr, flush=True)


def real_data(name):
    """Model files of one folder of the real data; empty, with a line, where it is absent."""
    folder = DATA / name
    models = sorted(path for path in folder.glob("*") if path.suffix.lower() in (".obj", ".glb"))
    if not models:
        say(f"skipped: no data set {name} in {os.path.relpath(DATA, ROOT)}")
    return models


def table(head, rows):
    """A Markdown table: first column to the left, the others to the right."""
    lines = ["| " + " | ".join(head) + " |"]
    lines.append("|---|" + "---:|" * (len(head) - 1))
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def write_between_markers(file, marker, text):
    """Replaces what is between `<!-- marker -->` and `<!-- /marker -->`."""
    begin, end = f"<!-- {marker} -->", f"<!-- /{marker} -->"
    old = file.read_text()
    new, count = re.subn(
        re.escape(begin) + ".*?" + re.escape(end),
        lambda _: f"{begin}\n{text.rstrip()}\n{end}",
        old,
        flags=re.DOTALL,
    )
    if count != 1:
        sys.exit(f"{file}: expected one {begin} … {end}, found {count}")
    file.write_text(new)


def machine():
    """One paragraph: what the figures were measured on, when, and with what."""
    version = subprocess.check_output(["git", "describe", "--always"], cwd=ROOT, text=True).strip()
    # Pages that other scripts have just written change nothing that is measured.
    changes = ["git", "diff", "--quiet", "HEAD", "--", ".", ":!docs", ":!README.md"]
    version += "-dirty" if subprocess.run(changes, cwd=ROOT).returncode else ""
    manifest = (ROOT / "Cargo.toml").read_text()
    package = re.search(r'^version = "(.*)"', manifest, re.MULTILINE).group(1)
    compiler = subprocess.check_output(["rustc", "--version"], text=True).split()[1]
    return (
        f"{cpu_model()}, {os.cpu_count()} cores, {memory_bytes() / 2**30:.0f} GiB of memory, "
        f"{platform.system()} {platform.release()}, rustc {compiler}; "
        f"hlod {package} ({version}), {time.strftime('%Y-%m-%d')}."
    )


def cpu_model():
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or "unknown processor"
    found = re.search(r"^model name\s*:\s*(.*)$", text, re.MULTILINE)
    return found.group(1).strip() if found else platform.machine()


def memory_bytes():
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def texels_written(result):
    """Texels of all nodes' own textures and of those that they share."""
    shared = result["scene"]["shared_textures"]
    return sum(level["texels"] for level in result["report"]["levels"]) + sum(
        texture["width"] * texture["height"] for texture in shared
    )


def quantity(number):
    for size, unit in ((1e9, " G"), (1e6, " M"), (1e3, " k")):
        if number >= size:
            return f"{number / size:.3g}{unit}"
    return f"{number:.0f}"
