"""The DRAM model against Ramulator 1 on the same streams of reads. Needs cmake and a C++ compiler."""

import csv
import os
from pathlib import Path

from .common import CARGO, ROOT, execute, needs


def run(study):
    needs("cmake")
    target = Path(os.environ.get("CARGO_TARGET_DIR", "target"), "peers")
    done = execute(f"{CARGO} run --quiet --release --locked --manifest-path tests/peers/ramulator/Cargo.toml --target-dir", target, folder=ROOT)
    heading, *rows = csv.reader(done.out.splitlines())
    study.write("dram-peer", "", " | ".join(heading), rows)
