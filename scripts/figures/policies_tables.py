"""Tables of a comparison of policies; see scripts/policies."""

import statistics

from common import table

PATHS = ["walk", "fly", "rise", "turn"]
TARGETS = [10, 30, 60]
# The target of which all figures are told.
TOLD = 30
# The paths along which every toggle is drawn.
POPPED = ["walk", "rise"]
COLUMNS = [
    ("flip_mean", "FLIP", 4),
    ("flip_p95", "p95", 4),
    ("flip_to_oracle", "to oracle", 4),
    ("frame_ms_p95", "frame p95, ms", 1),
    ("late_percent", "late, %", 1),
    ("longest_late_s", "longest late, s", 1),
    ("used_percent", "used, %", 0),
    ("toggles_per_min", "toggles/min", 0),
    ("lacking_percent", "lacking, %", 1),
    ("read_mb", "read, MB", 1),
    ("peak_mb", "peak, MB", 1),
    ("estimate_mean_percent", "estimate, %", 1),
    ("estimate_sd_percent", "±", 1),
]
CAUSES = [
    ("chosen_per_min", "chosen"),
    ("arrived_per_min", "arrived"),
    ("evicted_per_min", "evicted"),
    ("came_into_view_per_min", "came into view"),
]


def mean(rows, column):
    values = [float(row[column]) for row in rows if row[column]]
    return statistics.fmean(values) if values else None


def text(value, digits):
    return "–" if value is None else f"{value:.{digits}f}".replace("-", "−")


def policies(rows):
    return list(dict.fromkeys(row["policy"] for row in rows))


def at(rows, **wanted):
    return [row for row in rows if all(row[key] == str(value) for key, value in wanted.items())]


def everything(rows):
    head = ["policy"] + [name for _, name, _ in COLUMNS]
    body = []
    for policy in policies(rows):
        of = at(rows, policy=policy, target_ms=TOLD)
        cells = [text(mean(of, column), digits) for column, _, digits in COLUMNS]
        body.append([f"`{policy}`", *cells])
    return f"All scenes and paths, target {TOLD} ms:\n\n" + table(head, body)


def pareto(rows):
    head = ["policy"] + [f"{target} ms" for target in TARGETS]
    body = []
    for policy in policies(rows):
        cells = []
        for target in TARGETS:
            of = at(rows, policy=policy, target_ms=target)
            flip, p95 = mean(of, "flip_mean"), mean(of, "frame_ms_p95")
            cells.append(f"{text(flip, 4)} at {text(p95, 1)}")
        body.append([f"`{policy}`", *cells])
    return "FLIP at the 95th percentile of frame times in ms, by target:\n\n" + table(head, body)


def pairs(figures):
    first = figures["first"]
    head = ["policy", "target, ms", "FLIP", "late, %", "toggles/min", "frame p95, ms"]
    columns = [
        ("flip_mean", 4),
        ("late_percent", 1),
        ("toggles_per_min", 0),
        ("frame_ms_p95", 1),
    ]
    body = []
    for at_target in figures["targets"]:
        for policy, of in at_target["policies"].items():
            if policy == first:
                continue
            cells = []
            for column, digits in columns:
                more = of[column]["more_than_first"]
                cells.append(f"{text(more['mean'], digits)} ± {text(more['half'], digits)}")
            body.append([f"`{policy}`", f"{at_target['target_ms']:.0f}", *cells])
    return (
        f"How much more than `{first}`, mean over pairs of runs along the same path with half of its "
        "95 % interval:\n\n" + table(head, body)
    )


def pops(rows):
    head = ["policy", "pops, ΣFLIP", "toggles/min"]
    body = []
    for policy in policies(rows):
        of = at(rows, policy=policy)
        cells = [text(mean(of, "pop_flip_sum"), 3), text(mean(of, "toggles_per_min"), 0)]
        body.append([f"`{policy}`", *cells])
    return (
        f"The change of the image by every toggle of a run, {' and '.join(POPPED)}, target {TOLD} ms, means "
        "over scenes:\n\n" + table(head, body)
    )


def by_path(rows, scene):
    head = ["policy"] + [f"{path}: FLIP" if i == 0 else what for path in PATHS for i, what in enumerate(["FLIP", "late, %", "toggles/min"])]
    body = []
    for policy in policies(rows):
        cells = []
        for path in PATHS:
            of = at(rows, policy=policy, target_ms=TOLD, scene=scene, path=path)
            cells += [
                text(mean(of, "flip_mean"), 4),
                text(mean(of, "late_percent"), 1),
                text(mean(of, "toggles_per_min"), 0),
            ]
        body.append([f"`{policy}`", *cells])
    return table(head, body)


def causes(rows):
    head = ["policy"] + [name for _, name in CAUSES]
    body = []
    for policy in policies(rows):
        of = at(rows, policy=policy, target_ms=TOLD)
        body.append([f"`{policy}`", *[text(mean(of, column), 1) for column, _ in CAUSES]])
    return table(head, body)
