"""What the default policy reaches beside the others: a table and a plot; see scripts/policies."""

import statistics
from functools import partial

from common import table
from policies_tables import PATHS, POPPED, TARGETS, TOLD, at, mean, policies, text

OURS = "gain-over-price"
THESIS = "lakhia"
ORACLE = "oracle"
# Image errors that are no further apart than this are the same.
SAME = 0.02
# Percent of frames that may be late.
LATE = 1
# Policies as near to the least image error as this are compared by how much their images jump.
NEAR = 0.05


def table_of(figures):
    everywhere = figures["everywhere"]
    told = at(everywhere, target_ms=TOLD)
    line = partial(figure, names=fair(told))
    rows = [
        line("frames late by more than a tenth, mean, %", told, "late_percent", 1),
        line("the same on the worst path", told, "late_percent", 1, max),
        line("late in a row after `rise`, longest, s", at(told, path="rise"), "longest_late_s", 2, max),
        line("part of the target used while there is finer detail, %", told, "used_percent", 0),
    ]
    for target in TARGETS:
        rows.append(flip(f"FLIP at {target} ms", at(everywhere, target_ms=target)))
    rows.append(flip(f"FLIP at {TOLD} ms, on paths along which frames can keep to it", possible(told)))
    if figures["aside"]:
        rows.append(flip(f"FLIP at {TOLD} ms, scenes kept aside", figures["aside"]))
    rows.append(flip("FLIP at 1 ms with a fast card's constants", figures["fast"]))
    rows += [
        lowest(told),
        pops(figures["pops"], told),
        line("toggles a minute, standing", at(figures["still"], path="still"), "toggles_per_min", 0),
        line("toggles a minute, swaying", at(figures["still"], path="shake"), "toggles_per_min", 0),
        line("the same, after 15 s", at(figures["still"], path="shake"), "settled_toggles_per_min", 0),
        line("read again, a quarter of the memory, MB", figures["short"], "reread_mb", 1),
    ]
    for path in ["drive", "turn"]:
        rows.append(
            line(f"frames that lack a node, `{path}`, %", at(figures["ahead"], path=path), "lacking_percent", 2)
        )
    rows.append(selection(figures["selection"]))
    head = ["", f"`{OURS}`", f"`{THESIS}`", "best other"]
    return table(head, rows) + (
        "\n*Best other* is of those whose image error at 30 ms is at most twice as large: what draws little is "
        "never late, and neither reads nor changes much.\n"
    )


def others(rows):
    return [name for name in policies(rows) if name not in (OURS, THESIS, ORACLE)]


def fair(told):
    """Those whose image error is at most twice as large as ours."""
    most = 2 * mean(at(told, policy=OURS), "flip_mean")
    return [name for name in others(told) if mean(at(told, policy=name), "flip_mean") <= most]


def of(rows, policy, column, how):
    values = [float(row[column]) for row in at(rows, policy=policy) if row[column]]
    return how(values) if values else None


def figure(what, rows, column, digits, how=statistics.fmean, names=()):
    """A figure of our policy and the thesis's, and that of the best other with its name."""
    best = max if column == "used_percent" else min
    values = {name: of(rows, name, column, how) for name in names}
    values = {name: value for name, value in values.items() if value is not None} or {"–": None}
    name = best(values, key=values.get)
    ours, thesis = (text(of(rows, policy, column, how), digits) for policy in (OURS, THESIS))
    return [what, ours, thesis, f"{text(values[name], digits)}, `{name}`"]


def flip(what, rows):
    """FLIP, beside policies whose frames are no longer than ours."""
    ours = mean(at(rows, policy=OURS), "flip_mean")
    p95 = mean(at(rows, policy=OURS), "frame_ms_p95")

    def cell(name):
        value, ms = (mean(at(rows, policy=name), column) for column in ("flip_mean", "frame_ms_p95"))
        return f"{text(value, 4)} at {text(ms, 1)} ms"

    def value(name):
        return mean(at(rows, policy=name), "flip_mean")

    names = [name for name in others(rows) if mean(at(rows, policy=name), "frame_ms_p95") <= 1.02 * p95]
    best = min(names or others(rows), key=value)
    less = f", ours {text((ours / value(best) - 1) * 100, 0)} %" if value(best) else ""
    return [what, cell(OURS), cell(THESIS), f"{cell(best)}, `{best}`{less}"]


def possible(rows):
    """Runs where some policy is hardly ever late: elsewhere roots alone take too long, and none can choose."""
    places = {(row["scene"], row["path"]) for row in rows if float(row["late_percent"]) <= LATE}
    return [row for row in rows if (row["scene"], row["path"]) in places]


def lowest(rows):
    """In how many places our image error is the lowest, or as good as that."""
    places = sorted({(row["scene"], row["path"]) for row in rows})
    count = 0
    for scene, path in places:
        here = at(rows, scene=scene, path=path)
        ours, p95 = (mean(at(here, policy=OURS), column) for column in ("flip_mean", "frame_ms_p95"))
        fair = [name for name in [THESIS, *others(rows)] if mean(at(here, policy=name), "frame_ms_p95") <= 1.02 * p95]
        least = min([mean(at(here, policy=name), "flip_mean") for name in fair], default=ours)
        count += ours <= least * (1 + SAME) + 5e-5
    what = "places with the lowest FLIP at no longer frames, or within 2 % of it"
    return [what, f"{count} of {len(places)}", "", ""]


def pops(rows, told):
    told = [row for row in told if row["path"] in POPPED]

    def error(name):
        return mean(at(told, policy=name), "flip_mean")

    near = [name for name in others(rows) if error(name) <= error(OURS) * (1 + NEAR)]
    sums = {name: mean(at(rows, policy=name), "pop_flip_sum") for name in [OURS, THESIS, *near]}
    best = min(near, key=sums.get, default=None)
    other = "none is as near" if best is None else f"{text(sums[best], 4)}, `{best}`"
    return [
        "summed change of the image by toggles, of those within 5 % of its FLIP",
        text(sums[OURS], 4),
        text(sums[THESIS], 4),
        other,
    ]


def selection(printed):
    """Milliseconds to choose, of the larger scene, of policies that visit as many nodes as ours."""
    times, visited = {}, {}
    for name, _, nodes, _, select_ms, _ in map(str.split, printed.splitlines()[1:]):
        times[name], visited[name] = float(select_ms), int(nodes)
    times = {name: ms for name, ms in times.items() if visited[name] > 0.9 * visited[OURS]}
    best = min((name for name in times if name not in (OURS, THESIS)), key=times.get)
    cells = [f"{times[name]:.2f}" for name in (OURS, THESIS, best)]
    return ["choosing at 3,000 nodes visited, ms", *cells[:2], f"{cells[2]}, `{best}`"]


def plot(rows, targets, file):
    """Image error against frame time, on each path and on all."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "hlod"
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(PATHS) + 1, figsize=(18, 4.2))
    markers = "o^sPXDvd*"
    for axis, path in zip(axes, [None, *PATHS]):
        here = rows if path is None else at(rows, path=path)
        for marker, name in zip(markers, [OURS, THESIS, *others(rows)]):
            points = []
            for target in targets:
                there = at(here, policy=name, target_ms=target)
                points.append([mean(there, column) for column in ("frame_ms_p95", "flip_mean")])
            ours = {"linewidth": 2.5, "zorder": 3} if name == OURS else {"linewidth": 1}
            axis.plot(*zip(*sorted(points)), marker=marker, label=name, **ours)
        axis.set(title=path or "all paths", xlabel="p95 frame time, ms", yscale="log")
    axes[0].set_ylabel("FLIP")
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(file, metadata={"Date": None})
