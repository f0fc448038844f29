#!/usr/bin/env python3
"""Draws bench/results/*.json into docs/benchmarks/*.png (needs matplotlib: Debian's python3-matplotlib).

    bench/plot.py [RESULTS_DIR] [OUTPUT_DIR]
"""
import json
import pathlib
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[1]
OURS, RIVAL, PAPER, FLOOR = "#c2530a", "#4a6fa5", "#8a8f98", "#2f3640"
PERCENTILES = [("p50", "50 %"), ("p99", "99 %"), ("p999", "99.9 %"), ("p9999", "99.99 %"), ("max", "worst")]

plt.rcParams.update({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
                     "grid.alpha": 0.25, "figure.dpi": 110, "savefig.bbox": "tight"})


def where(report):
    return "%s, %s, commit %s" % (report["machine"], report["kernel"], report["commit"])


def finish(figure, report, path):
    figure.text(0.01, -0.02, where(report), fontsize=7.5, color="#6a6f78")
    figure.savefig(path)
    plt.close(figure)


def pulse_train(report, path):
    """Distance of the interval from 100 us, by percentile, for each variant under each load."""
    colours = {"listing1": PAPER, "listing1_plain": "#c9ccd1", "listing2": RIVAL, "absolute": OURS, "floor": FLOOR, "floor_relative": "#9aa5b1"}
    figure, axes = plt.subplots(1, 2, figsize=(9.5, 3.6), sharey=True)
    for axis, load in zip(axes, ("idle", "submission")):
        for row in (r for r in report["results"] if r["load"] == load):
            away = [abs(row["interval_ns_" + key] - 100_000) / 1000 for key, _ in PERCENTILES]
            axis.plot([max(0.001, each) for each in away], marker="o", color=colours[row["variant"]],
                      linestyle="--" if row["variant"].startswith("floor") else "-",
                      label="%s  %.1f Hz" % (row["variant"], row["mean_hz"]))
        axis.set_yscale("log")
        axis.set_xticks(range(len(PERCENTILES)), [name for _, name in PERCENTILES])
        axis.set_title(load, fontsize=10)
        axis.legend(fontsize=8, frameon=False)
    axes[0].set_ylabel("interval's distance from 100 us (us)")
    finish(figure, report, path)


def budget(report, path):
    """Bursts as multiples of the budget."""
    cases = sorted({(r["budget_us"], r["period_us"]) for r in report["results"]})
    figure, axis = plt.subplots(figsize=(7.5, 3.2))
    for offset, (mechanism, colour) in enumerate((("sporadic_server", OURS), ("sched_deadline", RIVAL))):
        rows = {(r["budget_us"], r["period_us"]): r for r in report["results"] if r["mechanism"] == mechanism}
        places = [i + (offset - 0.5) * 0.3 for i, case in enumerate(cases) if case in rows]
        found = [rows[case] for case in cases if case in rows]
        axis.bar(places, [r["burst_us_p50"] / r["budget_us"] for r in found], 0.28, color=colour, alpha=0.5)
        for suffix, marker, label in (("p999", "_", "99.9 %"), ("max", "x", "worst")):
            axis.scatter(places, [r["burst_us_" + suffix] / r["budget_us"] for r in found], marker=marker, s=90, color=colour,
                         label="%s, %s" % (mechanism, label))
    axis.axhline(1, color=FLOOR, linewidth=1)
    axis.set_yscale("log")
    axis.set_xticks(range(len(cases)), ["%g ms in %g ms" % (c / 1000, t / 1000) for c, t in cases])
    axis.set_ylabel("burst / budget (bar: median)")
    axis.legend(fontsize=8, frameon=False)
    finish(figure, report, path)


def release(report, path):
    loads = [load for load in ("idle", "submission") if any(r["load"] == load for r in report["results"])]
    figure, axes = plt.subplots(1, len(loads), figsize=(4.2 * len(loads), 3.2), sharey=True, squeeze=False)
    keys = [("p50", "50 %"), ("p99", "99 %"), ("p999", "99.9 %"), ("max", "worst")]
    for axis, load in zip(axes[0], loads):
        for offset, (who, colour) in enumerate((("qduino", OURS), ("cyclictest", RIVAL))):
            for row in (r for r in report["results"] if r["who"] == who and r["load"] == load):
                axis.bar([i + (offset - 0.5) * 0.36 for i in range(len(keys))], [row["latency_ns_" + k] / 1000 for k, _ in keys],
                         0.34, color=colour, label=who)
        axis.set_yscale("log")
        axis.set_xticks(range(len(keys)), [name for _, name in keys])
        axis.set_title(load, fontsize=10)
        axis.legend(fontsize=8, frameon=False)
    axes[0][0].set_ylabel("release latency (us)")
    finish(figure, report, path)


def channel(report, path):
    """Operations per second, a panel for each operation and size."""
    groups = {}
    for row in report["results"]:
        groups.setdefault((row["operation"], row["payload_bytes"]), []).append(row)
    operations = list(dict.fromkeys(r["operation"] for r in report["results"]))
    figure, axes = plt.subplots(1, len(operations), figsize=(2.9 * len(operations), 3.2))
    palette = [OURS, RIVAL, PAPER, FLOOR]
    for axis, operation in zip(axes, operations):
        sizes = sorted({size for name, size in groups if name == operation})
        names = list(dict.fromkeys(r["who"] for size in sizes for r in groups[operation, size]))
        for k, name in enumerate(names):
            heights = [next((r["ops_per_s"] for r in groups[operation, size] if r["who"] == name), 0) / 1e6 for size in sizes]
            axis.bar([i + (k - (len(names) - 1) / 2) * 0.25 for i in range(len(sizes))], heights, 0.23, color=palette[k], label=name)
        axis.set_xticks(range(len(sizes)), ["%d B" % size for size in sizes])
        axis.set_title(operation, fontsize=10)
        axis.legend(fontsize=6.5, frameon=False)
    axes[0].set_ylabel("million a second")
    figure.tight_layout()
    finish(figure, report, path)


def main():
    results = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "bench/results"
    output = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else ROOT / "docs/benchmarks"
    output.mkdir(parents=True, exist_ok=True)
    for draw in (pulse_train, budget, release, channel):
        source = results / (draw.__name__ + ".json")
        if not source.exists():
            print("%s: not there, not drawn" % source)
            continue
        draw(json.loads(source.read_text(encoding="utf-8")), output / (draw.__name__ + ".png"))
        print(output / (draw.__name__ + ".png"))


if __name__ == "__main__":
    main()
