"""The tables of selection and of the priority list in docs/runs.md, from two examples."""

import subprocess

from common import DOCS, Programs, machine, table, write_between_markers

DOCUMENT = DOCS / "runs.md"


def columns(programs, example):
    """What an example prints: rows of numbers below one line of names."""
    text = subprocess.check_output([programs.path(f"examples/{example}")], text=True)
    return [line.split() for line in text.splitlines()[1:]]


def main():
    programs = Programs(examples=["selection_time", "priority_list"], bins=False)
    selection = table(
        ["policy", "nodes of the scene", "visited", "drawn", "selection, ms", "rest of the engine, ms"],
        columns(programs, "selection_time"),
    )
    lists = table(
        ["nodes in the list", "list, ns an update", "heap, ns an update"],
        columns(programs, "priority_list"),
    )
    write_between_markers(
        DOCUMENT, "selection", f"{machine()}\n\n{selection}\n{lists}"
    )


if __name__ == "__main__":
    main()
