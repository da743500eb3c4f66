"""Tables of the cases that are hard on numbers; see scripts/stress."""

import os
import shutil
import subprocess
import sys

from common import DOCS, ROOT, Options, Programs, table, write_between_markers


def main():
    arguments = Options("stress", __doc__).parse()
    folder = Programs(bins=False).work / "stress"
    shutil.rmtree(folder, ignore_errors=True)
    command = ["cargo", "test", "--release", "--locked", "--no-default-features"]
    done = subprocess.run(
        [*command, "--test", "stress"],
        cwd=ROOT,
        env={**os.environ, "HLOD_STRESS_TABLE": str(folder)},
        stdout=sys.stderr,
    )
    # Numbers first, then names.
    tables = [path.read_text() for path in sorted(folder.glob("*.md"))]
    text = "\n".join(tables)
    print(text)
    if done.returncode != 0:
        sys.exit("some cases are not as their twins; nothing written")
    if arguments.write:
        write_between_markers(DOCS / "stress.md", "stress", text)
        write_between_markers(DOCS / "stress.md", "summary", summary(tables))


def summary(tables):
    """A row for each table: how many cases, how many are within 1 % in all figures."""
    rows = []
    for text in tables:
        lines = text.splitlines()
        cases = [[cell.strip() for cell in row.split("|")[1:-1]] for row in lines[4:] if row]
        refused = [case for case in cases if case[1] == "refused"]
        compared = [case for case in cases if case[1] != "refused"]
        counts = [[int(number) for number in case[2].split(" of ")] for case in compared]
        close = sum(found == of for found, of in counts)
        figures = f"{sum(found for found, _ in counts)} of {sum(of for _, of in counts)}"
        title = lines[0].removeprefix("### ")
        rows.append([title, str(len(cases)), str(len(refused)), str(close), figures])
    head = ["", "cases", "refused", "as their twin to 1 %", "figures within 1 %"]
    return table(head, rows)


if __name__ == "__main__":
    main()
