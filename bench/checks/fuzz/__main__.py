"""``python -m bench.checks.fuzz``: many trials, each in a process that may die of it, and the counts.

Trials run in a child; when a signal ends it that is an abort, and another child goes on with the next trial.
It writes below a folder of its own, which it removes.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import asdict
from pathlib import Path

from bench.checks.fuzz.sound import write_sound
from bench.checks.fuzz.trial import TARGETS, Ending, trial

_MEMORY_BYTES = 16 << 30
"""Address space of a child; numba and LLVM map several GB that they never touch."""


def main() -> int:
    """Run the trials, print the counts; 1 where one ended as none may."""
    parser = argparse.ArgumentParser(prog="python -m bench.checks.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0, help="number of the first trial")
    parser.add_argument("--child", nargs=2, type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    numbers = range(given.first, given.first + given.inputs)
    if given.child:
        return _child(numbers, *given.child)
    with tempfile.TemporaryDirectory(prefix="burrscan-fuzz-") as folder:
        sound = Path(folder) / "sound"
        sound.mkdir()
        write_sound(sound)
        endings, peak_mb = _all(numbers, sound, Path(folder))
    return _told(endings, given.first, peak_mb)


def _child(numbers: range, sound: Path, folder: Path) -> int:
    """Run trials in this process, a line of JSON after each."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, _MEMORY_BYTES))
    for number in numbers:
        ending = trial(number, sound=sound, work=folder / f"trial-{number}")
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        print(json.dumps({**asdict(ending), "peak_mb": peak_mb}), flush=True)
    return 0


def _all(numbers: range, sound: Path, folder: Path) -> tuple[list[Ending], float]:
    """All trials, however many children they take, and the most memory one child held."""
    endings, peak_mb = list[Ending](), 0.0
    while len(endings) < len(numbers):
        first, left = numbers[len(endings)], len(numbers) - len(endings)
        done = subprocess.run(  # noqa: S603 (ourselves)
            [
                sys.executable, "-m", "bench.checks.fuzz", "--first", str(first), "--inputs", str(left),
                "--child", str(sound), str(folder),
            ],
            capture_output=True, text=True, check=False, env={**os.environ, "BURRSCAN_TRANSPORTS": "off"},
        )  # fmt: skip
        for line in done.stdout.splitlines():
            told = json.loads(line)
            peak_mb = max(peak_mb, told.pop("peak_mb"))
            endings.append(Ending(**told))
        if done.returncode != 0 and len(endings) < len(numbers):
            target = TARGETS[numbers[len(endings)] % len(TARGETS)]
            endings.append(Ending(f"{target.command[0]} {target.file}", "abort", done.stderr[-300:]))
    return endings, peak_mb


def _told(endings: list[Ending], first: int, peak_mb: float) -> int:
    for kind, count in Counter(ending.kind for ending in endings).most_common():
        print(f"{count:6d} {kind}")
    print(f"{peak_mb:6.0f} MB at most")
    bad = [(number, ending) for number, ending in enumerate(endings, first) if ending.bad]
    for number, ending in bad:
        print(f"trial {number}: {ending.target}: {ending.kind}: {ending.said}")
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
