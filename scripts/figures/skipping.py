"""Measures work that is skipped; see scripts/skipping."""

import csv
import json
import resource
import shutil
import subprocess

from common import DOCS, Options, Programs, machine, run, say, table, write_between_markers

TRIANGLES = 400_000
BLOCKS = 16


def main():
    runs = ("the fastest of how many runs", 3)
    arguments = Options("skipping", __doc__, runs=runs).parse()
    programs = Programs()
    bench = Bench(programs, arguments.runs)
    rows = [row for part in (bench.builds, bench.inputs, bench.view) for row in part()]
    head = ["skipped", "where", "with it", "without it"]
    text = machine() + "\n\n" + table(head, rows)
    print(text)
    if arguments.write:
        write_between_markers(DOCS / "skipping.md", "skipping", text)


class Bench:
    def __init__(self, programs, runs):
        self.programs, self.runs = programs, runs
        size = {"blocks": BLOCKS, "triangles": TRIANGLES}
        self.city = programs.city("skip-textured", **size)
        self.plain = programs.city("skip-plain", **size, no_textures=True)
        self.out = programs.work / "skip-out"

    def build(self, inputs, *options, fresh=True):
        """Processor seconds of the fastest of several builds, and its report."""
        fastest, report = float("inf"), None
        for _ in range(self.runs):
            if fresh:
                shutil.rmtree(self.out, ignore_errors=True)
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            command = [self.programs.path("hlod-build"), "--quiet", *options]
            run([*command, *map(str, inputs), str(self.out)])
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            if spent < fastest:
                fastest = spent
                report = json.loads((self.out / "build.json").read_text())
        return fastest, report

    def builds(self):
        """Steps of a build that a scene does not need."""
        say("textures, cuts, threads")
        textured, report = self.build([self.city], "--threads", "1")
        plain, plain_report = self.build([self.plain], "--threads", "1")
        stages = [
            {stage["stage"]: stage["seconds"] for stage in found["stages"]}
            for found in (report, plain_report)
        ]
        work = [sum(found.get(name, 0) for name in ("pictures", "atlas")) for found in stages]
        yield ["textures and atlases", "no textures", seconds(work[0]), seconds(work[1])]
        yield ["the same, whole build", "no textures", seconds(textured), seconds(plain)]
        whole, _ = self.build([self.plain], "--threads", "1", "--desired-tris", "10000000")
        cut = "cutting, simplifying, measuring"
        yield [cut, "blocks within their budget", seconds(plain), seconds(whole)]
        small = self.programs.city("skip-small", blocks=1, triangles=2_000, no_textures=True)
        one, _ = self.build([small], "--threads", "1")
        all_cores, _ = self.build([small])
        yield ["a second thread's work", "2,000 triangles", seconds(all_cores), seconds(one)]

    def inputs(self):
        """What an earlier build has done already."""
        say("inputs that have not changed")
        folder = self.programs.work / "skip-split"
        shutil.rmtree(folder, ignore_errors=True)
        size = ["--blocks", str(BLOCKS), "--triangles", str(TRIANGLES)]
        run([self.programs.path("make-city"), "--quiet", "--split", *size, str(folder)])
        first, _ = self.build([folder])
        again, _ = self.build([folder], fresh=False)
        yield ["everything", "no input has changed", seconds(first), seconds(again)]
        one = sorted(folder.glob("*.obj"))[0]
        spent = []
        for number in range(self.runs):
            with open(one, "a") as model:
                model.write(f"# {number}\n")
            runs, self.runs = self.runs, 1
            spent.append(self.build([folder], fresh=False)[0])
            self.runs = runs
        where = f"1 of {BLOCKS} inputs has changed"
        yield ["blocks that it does not meet", where, seconds(first), seconds(min(spent))]
        shutil.rmtree(folder)

    def view(self):
        """Nodes that the camera does not see, in selection and in loading."""
        say("nodes outside of the view")
        self.runs = 1
        _, report = self.build([self.city])
        path, results = self.programs.work / "skip.csv", self.programs.work / "skip-run"
        bench = self.programs.path("hlod-bench")
        command = [bench, "make-path", str(self.out), "--kind", "walk", "--frames", "600"]
        subprocess.run([*command, "--out", str(path)], check=True, stdout=subprocess.DEVNULL)
        command = [bench, str(self.out), str(path), "--quiet", "--clock", "model"]
        run([*command, "--target-ms", "30", "--out", str(results)])
        with open(results / "frames.csv") as log:
            frames = list(csv.DictReader(log))
        nodes = sum(level["nodes"] for level in report["levels"])
        size = sum(level["bytes"] for level in report["levels"])
        visited = sum(int(frame["visited"]) for frame in frames) / len(frames)
        where = "a walk of 600 frames"
        yield ["visits of nodes out of view or below the front", where, f"{nodes:,}", f"{visited:.0f}"]
        read = sum(int(frame["read_bytes"]) for frame in frames)
        yield ["loading of nodes out of view", where, f"{size / 1e6:.1f} MB", f"{read / 1e6:.1f} MB"]


def seconds(number):
    return f"{number:.2f} s" if number >= 0.1 else f"{number * 1e3:.0f} ms"


if __name__ == "__main__":
    main()
