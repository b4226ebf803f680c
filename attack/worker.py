"""Process that runs cases one after another with a memory limit; the caller limits the time.

Reads one ``kind number`` per line, and answers each with a line of JSON. The output of a case is
written to files, so that the folder of the case shows the cause even if the process dies.
"""

from __future__ import annotations

import json
import os
import resource
import runpy
import shutil
import sys
import traceback
from pathlib import Path
from typing import Any

from access_av import InputError, RecordingError, SettingsError
from access_av.cli.terminal import plain
from access_av.report.chart_code import chart_code
from attack import files, kinds
from attack.verdict import judge

MEMORY_BYTES = 2 << 30


def limit_memory() -> None:
    """Limits the address space to the current size plus `MEMORY_BYTES`."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    taken = pages * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + MEMORY_BYTES,) * 2)


def execute(command: list[str]) -> dict[str, Any]:
    """Runs a command in this process: exit code, and exceptions other than an exit."""
    from access_av.cli import main

    sys.argv = list(command)
    raised = ""
    code: object = 0
    try:
        if command[0] == "access-av":
            main.main()
        else:
            runpy.run_path(command[1], run_name="__main__")
    except SystemExit as stopped:
        code = stopped.code or 0
    except (SettingsError, RecordingError, InputError, OSError) as error:
        # A script may raise these errors; the command line has to report them as messages.
        print(f"error: {plain(str(error))}", file=sys.stderr)
        code = 2 if command[0] == "python" else "an error that the command line let pass"
    except BaseException:  # any other exception is a finding
        raised = traceback.format_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    return {"code": code, "raised": raised}


def run(seed: int, kind: str, number: int, folder: Path) -> dict[str, Any]:
    """Creates a case in ``folder``, runs it there, and judges it."""
    folder.mkdir(parents=True)
    command = kinds.make(seed, kind, number, folder)
    before = set(folder.rglob("*"))
    os.chdir(folder)
    kept = [os.dup(1), os.dup(2)]
    printed = [folder / "stdout", folder / "stderr"]
    for descriptor, file in enumerate(printed, start=1):
        to = os.open(file, os.O_WRONLY | os.O_CREAT)
        os.dup2(to, descriptor)
        os.close(to)
    try:
        end = execute(command)
    finally:
        for descriptor, saved in enumerate(kept, start=1):
            os.dup2(saved, descriptor)
            os.close(saved)
        os.chdir(folder.parent)
    out, err = (file.read_text(encoding="utf-8", errors="replace") for file in printed)
    end = {**end, "out": out, "err": err}
    verdict = judge(folder, command, {*before, *printed}, end, odometer=kind == "drive")
    return vars(verdict)


def main() -> None:
    """Answers until the end of the input."""
    seed, place = int(sys.argv[1]), Path(sys.argv[2])
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    # Tables and charts are loaded before the limit is set, so that it applies to a case only.
    chart_code()
    files.recorded()
    limit_memory()
    print("ready", file=answers, flush=True)
    for line in sys.stdin:
        kind, number = line.split()
        folder = place / f"{kind}-{number}"
        found = run(seed, kind, int(number), folder)
        if not found["findings"]:
            shutil.rmtree(folder)
        print(json.dumps(found), file=answers, flush=True)


if __name__ == "__main__":
    main()
