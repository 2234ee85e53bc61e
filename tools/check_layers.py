#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The mlvi authors
# SPDX-License-Identifier: Apache-2.0
"""Checks the includes of src/mlvi against layers.toml: which module may see which, and who may use which library."""
import pathlib
import re
import sys

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')
ENTRY = re.compile(r'^"?([^"=]+?)"?\s*=\s*\[(.*)\]\s*$')


def read_table(path):
    """Reads the two tables of layers.toml (Python 3.10 of Ubuntu 22.04 has no tomllib)."""
    tables, current = {}, None
    for line in path.read_text().splitlines():
        line = line.split("#")[0].strip()
        if line.startswith("["):
            current = tables.setdefault(line.strip("[]"), {})
        elif match := ENTRY.match(line):
            current[match[1]] = re.findall(r'"([^"]+)"', match[2])
    return tables


def violations(root):
    tables = read_table(root / "layers.toml")
    modules, external = tables["modules"], tables["external"]
    for path in sorted((root / "src" / "mlvi").rglob("*")):
        if path.suffix not in (".h", ".cc"):
            continue
        module = path.relative_to(root / "src" / "mlvi").parts[0]
        if module not in modules:
            yield f"{path}: module '{module}' is not in layers.toml"
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if not (match := INCLUDE.match(line)):
                continue
            header = match[1]
            if header.startswith("mlvi/"):
                other = header.split("/")[1]
                if other != module and other not in modules[module]:
                    yield f"{path}:{number}: {module} must not include {other} ({header})"
            for prefix, allowed in external.items():
                if header.startswith(prefix) and module not in allowed:
                    yield f"{path}:{number}: {module} must not use {header}"


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    found = list(violations(root))
    print("\n".join(found) or "layers: every include goes down")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
