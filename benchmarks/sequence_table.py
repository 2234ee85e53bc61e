#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The mlvi authors
# SPDX-License-Identifier: Apache-2.0
"""LiDAR-inertial odometry on the simulated sequences of the paper, as the table of docs/simulated_sequences.md.

    benchmarks/sequence_table.py build/release/benchmarks/odometry_bench --seconds 60

Rows appear as runs finish; a run that fails is a row that says so.
"""
import argparse
import json
import subprocess

# Sequence, rig, ATE of the paper's LiDAR-only variant on the real recording (whole length).
SEQUENCES = [
    ("quad-easy", "newer_college", "0.073"),
    ("quad-medium", "newer_college", ""),
    ("quad-hard", "newer_college", "fail"),
    ("math-easy", "newer_college", "0.081"),
    ("math-medium", "newer_college", "fail"),
    ("math-hard", "newer_college", "fail"),
    ("undermine-hard", "newer_college", "fail"),
    ("stairs", "newer_college", "3.032"),
    ("cloister", "newer_college", "fail"),
    ("room-01", "m2dgr", "0.135"),
    ("room-02", "m2dgr", "0.128"),
    ("room-03", "m2dgr", "0.161"),
    ("hall-05", "m2dgr", "1.030"),
    ("door-02", "m2dgr", "0.194"),
    ("gate-03", "m2dgr", "0.108"),
    ("walk-01", "m2dgr", "0.077"),
    ("construction-upper-level-3", "hilti_2022", "fail"),
    ("basement-2", "hilti_2022", "fail"),
    ("attic-to-upper-gallery-2", "hilti_2022", "3.918"),
    ("corridor-lower-gallery-2", "hilti_2022", "fail"),
]


def measure(bench, sequence, rig, seconds, settings):
    command = [bench, "--sequence", sequence, "--rig", rig, "--seconds", str(seconds), "--json"]
    for setting in settings:
        command += ["--set", setting]
    run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False)
    if run.returncode != 0 or not run.stdout.strip():
        return None
    return json.loads(run.stdout)


def number(value, form):
    return "" if value is None else form.format(value)


def row(sequence, seconds, paper, run):
    if run is None:
        return f"| {sequence} | {seconds:g} s | failed | | | | | | | {paper} |"
    share = 100.0 / max(1, run["sweeps"])
    cells = [sequence, f"{seconds:g} s", number(run["odometry_ate_m"], "{:.4f}"),
             number(run["trajectory_ate_m"], "{:.4f}"), number(run["attitude_rmse_deg"], "{:.2f}"),
             number(run["drift_percent"], "{:.2f}"), f"{share * run['used']:.0f} %",
             f"{share * run['degenerate']:.1f} %", str(run["resets"]), paper]
    return "| " + " | ".join(cells) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bench", help="the program odometry_bench")
    parser.add_argument("--seconds", type=float, default=60.0, help="length of each run")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="configuration")
    parser.add_argument("sequences", nargs="*", help="some of them (default: all)")
    arguments = parser.parse_intermixed_args()
    known = {name: (name, rig, paper) for name, rig, paper in SEQUENCES}
    unknown = [name for name in arguments.sequences if name not in known]
    if unknown:
        parser.error(f"unknown: {', '.join(unknown)}")
    print("| sequence | length | ATE | smoothed | attitude | drift, % | used | degenerate | resets | paper |")
    print("|---|---|---|---|---|---|---|---|---|---|", flush=True)
    for sequence, rig, paper in [known[name] for name in arguments.sequences] or SEQUENCES:
        run = measure(arguments.bench, sequence, rig, arguments.seconds, arguments.set)
        print(row(sequence, arguments.seconds, paper, run), flush=True)


if __name__ == "__main__":
    main()
