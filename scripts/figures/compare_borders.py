"""Compares ways of making coarse levels; see scripts/compare-borders."""

import statistics

from common import (
    DOCS,
    Options,
    Programs,
    machine,
    quantity,
    real_data,
    say,
    table,
    write_between_markers,
)

# (--borders, --simplify-from, --simplifier); the defaults first.
VARIANTS = [
    ("skirts", "children", "qem"),
    ("shared", "children", "qem"),
    ("locked", "children", "qem"),
    ("skirts", "original", "qem"),
    ("shared", "original", "qem"),
    ("locked", "original", "qem"),
    ("skirts", "children", "clustering"),
    ("skirts", "original", "clustering"),
]


def main():
    arguments = parse()
    programs = Programs()
    size = 100_000 if arguments.quick else 1_000_000
    city = programs.city(
        f"watertight-{size}", blocks=max(1, size // 80_000), triangles=size, watertight=True
    )
    inputs = [(f"generated city, closed, {size:,} triangles", [city])]
    if not arguments.no_real:
        for name in ["sceaux", "oblique_a"]:
            if models := real_data(name):
                inputs.append((f"`{name}`", models))
    parts = [machine()]
    for title, models in inputs:
        say(f"building {title} in {len(VARIANTS)} ways")
        results = {
            variant: fastest(programs, models, variant, arguments.runs) for variant in VARIANTS
        }
        parts += [f"### {title[0].upper()}{title[1:]}", size_table(results), error_table(results)]
    text = "\n\n".join(part.rstrip("\n") for part in parts) + "\n"
    print(text)
    if arguments.write:
        write_between_markers(DOCS / "choices.md", "figures", text)


def parse():
    runs = ("the fastest of how many runs", 1)
    return Options("compare-borders", __doc__, "0.1 M triangles", runs, real=True).parse()


def fastest(programs, models, variant, runs):
    borders, source, simplifier = variant
    options = ["--borders", borders, "--simplify-from", source, "--simplifier", simplifier]
    results = [programs.build(models, *options) for _ in range(runs)]
    return min(results, key=lambda result: result["seconds"])


def size_table(results):
    """Seconds, size, budgets, and what each level holds."""
    depth = len(next(iter(results.values()))["report"]["levels"])
    head = ["borders, from, simplifier", "seconds", "MB", "over budget"]
    head += [f"level {level}" for level in range(depth)]
    rows = []
    for variant, result in results.items():
        report = result["report"]
        levels = report["levels"]
        row = [", ".join(variant), f"{result['seconds']:.2f}"]
        row += [f"{sum(level['bytes'] for level in levels) / 1e6:.1f}"]
        row += [f"{len(report['over_budget']):,} of {len(result['scene']['nodes']):,}"]
        row += [
            f"{quantity(level['triangles'])} / {level['bytes'] / 1e6:.2f} MB" for level in levels
        ]
        rows.append(row)
    return "Triangles and bytes of the nodes on each level:\n\n" + table(head, rows)


def error_table(results):
    """Median and largest error of the simplified nodes on each level."""
    rows = []
    depth = 0
    for variant, result in results.items():
        nodes = [node for node in result["scene"]["nodes"] if node["first_child"] is not None]
        depth = max(node["level"] for node in nodes) + 1
        cells = []
        for level in range(depth):
            errors = [node["geometric_error"] for node in nodes if node["level"] == level]
            cells.append(f"{statistics.median(errors):.3f} / {max(errors):.3f}")
        rows.append([", ".join(variant), *cells])
    head = ["borders, from, simplifier", *(f"level {level}" for level in range(depth))]
    text = "Error of the simplified nodes in the input's unit, median / largest:\n\n"
    return text + table(head, rows)


if __name__ == "__main__":
    main()
