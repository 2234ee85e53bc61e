#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The mlvi authors
# SPDX-License-Identifier: Apache-2.0
"""LiDAR-inertial odometry on the simulated sequences of the paper, as the table of docs/simulated_sequences.md.

    benchmarks/sequence_table.py build/release/benchmarks/odometry_bench

Whole lengths unless --seconds says otherwise. The last columns are the paper's, on the real recordings: its LiDAR-only
variant (edges and planes) and FAST-LIO2 (points to planes, as the default here). Rows appear as runs finish; a run that
fails is a row that says so.
"""
import argparse
import json
import subprocess

# Sequence, rig, ATE on the real recording (whole length) of the paper's LiDAR-only variant and of FAST-LIO2.
SEQUENCES = [
    ("quad-easy", "newer_college", "0.073", "0.071"),
    ("quad-medium", "newer_college", "", ""),
    ("quad-hard", "newer_college", "fail", "0.080"),
    ("math-easy", "newer_college", "0.081", "0.111"),
    ("math-medium", "newer_college", "fail", "0.119"),
    ("math-hard", "newer_college", "fail", "0.067"),
    ("undermine-hard", "newer_college", "fail", "0.057"),
    ("stairs", "newer_college", "3.032", "fail"),
    ("cloister", "newer_college", "fail", "0.093"),
    ("room-01", "m2dgr", "0.135", "0.314"),
    ("room-02", "m2dgr", "0.128", "0.314"),
    ("room-03", "m2dgr", "0.161", "0.413"),
    ("hall-05", "m2dgr", "1.030", "1.178"),
    ("door-02", "m2dgr", "0.194", "0.284"),
    ("gate-03", "m2dgr", "0.108", "0.186"),
    ("walk-01", "m2dgr", "0.077", "0.111"),
    ("construction-upper-level-3", "hilti_2022", "fail", ""),
    ("basement-2", "hilti_2022", "fail", ""),
    ("attic-to-upper-gallery-2", "hilti_2022", "3.918", ""),
    ("corridor-lower-gallery-2", "hilti_2022", "fail", ""),
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


def row(sequence, paper, fast_lio, run):
    if run is None:
        return f"| {sequence} | | failed | | | | | | | | {paper} | {fast_lio} |"
    share = 100.0 / max(1, run["sweeps"])
    cells = [sequence, f"{0.1 * run['sweeps']:.0f} s", number(run["odometry_ate_m"], "{:.4f}"),
             number(run["trajectory_ate_m"], "{:.4f}"), number(run["attitude_rmse_deg"], "{:.2f}"),
             number(run["drift_percent"], "{:.2f}"), number(run["mean_nees"], "{:.0f}"), f"{share * run['used']:.0f} %",
             f"{share * run['degenerate']:.1f} %", str(run["resets"]), paper, fast_lio]
    return "| " + " | ".join(cells) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bench", help="the program odometry_bench")
    parser.add_argument("--seconds", type=float, default=0.0, help="length of each run (default: the sequence's own)")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="configuration")
    parser.add_argument("sequences", nargs="*", help="some of them (default: all)")
    arguments = parser.parse_intermixed_args()
    known = {sequence[0]: sequence for sequence in SEQUENCES}
    unknown = [name for name in arguments.sequences if name not in known]
    if unknown:
        parser.error(f"unknown: {', '.join(unknown)}")
    print("| sequence | length | ATE | smoothed | attitude | drift, % | NEES | used | degenerate | resets | paper | FAST-LIO2 |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|", flush=True)
    for sequence, rig, paper, fast_lio in [known[name] for name in arguments.sequences] or SEQUENCES:
        run = measure(arguments.bench, sequence, rig, arguments.seconds, arguments.set)
        print(row(sequence, paper, fast_lio, run), flush=True)


if __name__ == "__main__":
    main()
