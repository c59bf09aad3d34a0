"""``python -m bench.checks.fuzz``: many trials, each in a process that may die of it, and the counts.

Trials run in a child; when a signal ends it that is an abort, and another child goes on with the next trial.
It writes below a folder of its own, which it removes.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import asdict
from pathlib import Path

from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress

from bench.checks.fuzz.sound import write_sound
from bench.checks.fuzz.targets import TARGETS
from bench.checks.fuzz.trial import Ending, trial

_MEMORY_BYTES = 16 << 30
"""Address space of a child; numba and LLVM map several GB that they never touch."""


def main() -> int:
    """Run the trials, print the counts; 1 where one ended as none may."""
    parser = argparse.ArgumentParser(prog="python -m bench.checks.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0, help="number of the first trial")
    parser.add_argument("--only", nargs="+", metavar="COMMAND", default=[], help="trials of these commands")
    parser.add_argument("--child", nargs=2, type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    numbers = _numbers(given.first, given.inputs, given.only)
    if given.child:
        return _child(numbers, *given.child)
    with tempfile.TemporaryDirectory(prefix="burrscan-fuzz-") as folder:
        sound = Path(folder) / "sound"
        sound.mkdir()
        write_sound(sound)
        endings, peaks_mb = _all(numbers, given.only, sound, Path(folder))
    return _told(endings, numbers, peaks_mb)


def _numbers(first: int, count: int, only: list[str]) -> list[int]:
    """Numbers of trials from ``first`` on; of the commands named, where some are."""
    if unknown := set(only) - {target.command[0] for target in TARGETS}:
        raise SystemExit(f"no trial has the command {', '.join(sorted(unknown))}")
    wanted = (
        number
        for number in itertools.count(first)
        if not only or TARGETS[number % len(TARGETS)].command[0] in only
    )
    return list(itertools.islice(wanted, count))


def _child(numbers: list[int], sound: Path, folder: Path) -> int:
    """Run trials in this process, a line of JSON after each: what libraries print themselves is on stderr."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, _MEMORY_BYTES))
    with os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8") as report:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
        for number in numbers:
            ending = trial(number, sound=sound, work=folder / f"trial-{number}")
            peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
            print(json.dumps({**asdict(ending), "peak_mb": peak_mb}), file=report, flush=True)
    return 0


def _all(numbers: list[int], only: list[str], sound: Path, folder: Path) -> tuple[list[Ending], list[float]]:
    """All trials, however many children they take, and the most memory that each one's child had held."""
    endings, peaks_mb = list[Ending](), list[float]()
    said = folder / "stderr"
    with Progress(*Progress.get_default_columns(), MofNCompleteColumn(), console=Console(stderr=True)) as bar:
        task = bar.add_task("trials", total=len(numbers))
        while len(endings) < len(numbers):
            first, left = numbers[len(endings)], len(numbers) - len(endings)
            with said.open("wb") as stderr, subprocess.Popen(  # noqa: S603 (ourselves)
                [
                    sys.executable, "-m", "bench.checks.fuzz", "--first", str(first), "--inputs", str(left),
                    "--child", str(sound), str(folder), *(["--only", *only] if only else []),
                ],
                stdout=subprocess.PIPE, stderr=stderr, text=True,
                env={**os.environ, "BURRSCAN_TRANSPORTS": "off"},
            ) as child:  # fmt: skip
                for line in child.stdout or ():
                    told = json.loads(line)
                    peaks_mb.append(told.pop("peak_mb"))
                    endings.append(Ending(**told))
                    bar.update(task, completed=len(endings))
            if child.returncode != 0 and len(endings) < len(numbers):
                target = TARGETS[numbers[len(endings)] % len(TARGETS)]
                last = said.read_text("utf-8", "replace")[-300:]
                endings.append(Ending(f"{target.command[0]} {target.file}", "abort", last))
                peaks_mb.append(0.0)
    return endings, peaks_mb


def _told(endings: list[Ending], numbers: list[int], peaks_mb: list[float]) -> int:
    kinds = Counter(ending.kind for ending in endings)
    for kind, count in kinds.most_common():
        print(f"{count:6d} {kind}")
    for target in sorted({ending.target for ending in endings}):
        own = Counter(ending.kind for ending in endings if ending.target == target)
        print(f"       {target}: " + ", ".join(f"{count} {kind}" for kind, count in own.most_common()))
    most = max(range(len(peaks_mb)), key=peaks_mb.__getitem__)
    print(f"{peaks_mb[most]:6.0f} MB at most, by trial {numbers[most]}")
    for number, ending in zip(numbers, endings, strict=True):
        if ending.bad:
            print(f"trial {number}: {ending.target}: {ending.kind}: {ending.said}")
    return int(any(ending.bad for ending in endings))


if __name__ == "__main__":
    sys.exit(main())
