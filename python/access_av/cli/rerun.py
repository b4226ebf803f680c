"""The command ``rerun``: compute results again and compare their bytes."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from access_av.cli import options as opt
from access_av.cli.terminal import console, say, show_warning
from access_av.errors import InputError
from access_av.tables import renamed

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

app = typer.Typer()

MANIFEST = "manifest.json"
# Entries of a manifest that differ between two runs of the same command.
NOT_CONTENT = (
    "written", "command", "repeat", "directory", "duration_s", "inputs", "commit", "version",
)  # fmt: skip
# Folders of intermediate results, from which an interrupted command continues.
NOT_RESULTS = ("parts",)
# Options without an influence on the results, including those of earlier versions.
WHERE = ("--out", "--executor", "--threads", "--shard", "--dask")


@dataclass(frozen=True)
class Difference:
    """A file that differs.

    Attributes
    ----------
    what
        ``missing``, ``additional``, or how the content differs.
    """

    file: str
    what: str


@opt.command(
    app, "Plants and scenarios", "run paper --out results/mine; access-av rerun results/mine"
)
def rerun(
    results: Annotated[Path, Argument(help="Results directory of the command to repeat.")],
    directory: Annotated[
        Path | None,
        Option(help="Working directory with the inputs [default: that of the first run]."),
    ] = None,
    keep: Annotated[
        Path | None, Option(help="Directory for the new results [default: they are removed].")
    ] = None,
    as_json: opt.AsJson = False,
) -> None:
    """Compute the results of a command again, and compare them byte by byte.

    The manifest contains the command, its working directory, and size and SHA-256 of each input.
    Changed inputs are reported. If an input is missing or changed and the results contain a copy of
    the settings, the copy is used; the report then shows the copy. Times, version and commit in the
    manifest are not compared.

    Exit code 0: all files are identical. 2: the command cannot be repeated. 3: files differ; each
    is listed with its difference.
    """
    from access_av.tables.results_directory import json_text

    manifest = _manifest(results)
    where = directory or Path(manifest.get("directory") or ".")
    if not where.is_dir():
        raise InputError(f"{where}: the working directory does not exist; add --directory")
    changed = _changed_inputs(manifest, where)
    for line in changed:
        show_warning(line)
    arguments = _arguments(manifest)
    if changed and manifest.get("repeat"):
        show_warning("the copy of the settings in the results is used")
        where = results
        arguments = renamed.current(shlex.split(manifest["repeat"])[1:])
    with tempfile.TemporaryDirectory(prefix="access-av-rerun-") as scratch:
        again = _run(arguments, where, Path(scratch), keep)
        differences = compared(results, again)
        now = _manifest(again)
    written_by, repeated_by = (
        {it: one.get(it) for it in ("version", "commit")} for one in (manifest, now)
    )
    record = {
        "identical": not differences,
        "files": len(_files(results)),
        "differences": [asdict(each) for each in differences],
        "changed_inputs": changed,
        "written_by": written_by,
        "repeated_by": repeated_by,
    }
    if as_json:
        print(json_text(record))
    else:
        _show(record)
    if differences:
        raise typer.Exit(opt.MISSED)


def _show(record: Mapping[str, Any]) -> None:
    for each in record["differences"]:
        say(f"{each['file']}: {each['what']}")
    if record["written_by"] != record["repeated_by"]:
        was, now = (
            f"{it['version']} ({it['commit'] or 'no commit'})"
            for it in (record["written_by"], record["repeated_by"])
        )
        console.print(f"Written by version {was}, repeated by {now}.")
    count = len(record["differences"])
    console.print(
        f"All {record['files']} files are identical."
        if not count
        else f"{count} of {record['files']} files differ."
    )


def _manifest(results: Path) -> dict[str, Any]:
    file = results / MANIFEST
    if not file.is_file():
        raise InputError(f"{results}: no results of a command ({MANIFEST} is missing)")
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(f"{file}: not JSON ({error})") from error
    if not isinstance(found, dict) or not isinstance(found.get("command"), list):
        raise InputError(f"{file}: `command` is missing; rerun needs it")
    return found


def _arguments(manifest: Mapping[str, Any]) -> list[str]:
    """Returns the arguments of the command without the options of :data:`WHERE`.

    Command and options of an earlier version are replaced by their present names.
    """
    _, *typed = map(str, manifest["command"])
    found, skipped = list[str](), False
    for argument in typed:
        if skipped:
            skipped = False
        elif argument in WHERE:
            skipped = True
        elif not argument.startswith(tuple(f"{it}=" for it in WHERE)):
            found.append(argument)
    return renamed.current(found)


def _changed_inputs(manifest: Mapping[str, Any], where: Path) -> list[str]:
    from access_av.tables.inputs import described

    changed = []
    for name, was in manifest.get("inputs", {}).items():
        file = where / name
        if not file.is_file():
            changed.append(f"{name}: this input is missing in {where}")
        elif described(file) != was:
            changed.append(f"{name}: this input has changed since the results were written")
    return changed


def _run(arguments: Sequence[str], where: Path, scratch: Path, keep: Path | None) -> Path:
    """Runs the command with an empty results folder; returns the directory that it wrote."""
    out = scratch / "out" if keep is None else keep.absolute()
    if out.exists() and any(out.iterdir()):
        raise InputError(f"{out}: not empty; --keep needs a new directory")
    done = subprocess.run(
        [sys.executable, "-m", "access_av", *arguments, "--out", str(out)],
        cwd=where,
        env={**os.environ, "ACCESS_AV_RESULTS": str(scratch / "results")},
        capture_output=True,
        text=True,
    )
    # A command with a missed target (exit code 3) has written its results, too.
    if done.returncode not in (0, opt.MISSED) or not (out / MANIFEST).is_file():
        raise InputError(
            f"the command failed again (exit code {done.returncode}): "
            f"access-av {' '.join(arguments)}\n{done.stderr.strip()}"
        )
    return out


def _files(folder: Path) -> dict[str, Path]:
    return {
        str(path.relative_to(folder)): path
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.relative_to(folder).parts[0] not in NOT_RESULTS
    }


def compared(first: Path, second: Path) -> list[Difference]:
    """Returns the files of two results directories that differ, in the order of their names."""
    mine, its = _files(first), _files(second)
    found = []
    for name in sorted({*mine, *its}):
        if name not in its:
            found.append(Difference(name, "missing in the new results"))
        elif name not in mine:
            found.append(Difference(name, "only in the new results"))
        elif mine[name].read_bytes() != its[name].read_bytes():
            found += [Difference(name, what) for what in _how(name, mine[name], its[name])]
    return found


def _how(name: str, first: Path, second: Path) -> Iterator[str]:
    """Yields how the content of two files differs; nothing if only the manifest's times differ."""
    if name == MANIFEST:
        contents = [_manifest(it.parent) for it in (first, second)]
        keys = sorted({*contents[0], *contents[1]} - {*NOT_CONTENT})
        differ = [key for key in keys if contents[0].get(key) != contents[1].get(key)]
        if differ:
            yield f"entries differ: {', '.join(differ)}"
    elif name.endswith(".parquet"):
        yield _tables(first, second)
    else:
        yield _texts(first, second)


def _tables(first: Path, second: Path) -> str:
    import polars as pl

    one, other = pl.read_parquet(first), pl.read_parquet(second)
    if one.schema != other.schema:
        return "other columns"
    if one.height != other.height:
        return f"{one.height} and {other.height} rows"
    parts = []
    for column in one.columns:
        if one[column].equals(other[column]):
            continue
        text = column
        if one[column].dtype.is_numeric():
            largest = (one[column].cast(pl.Float64) - other[column].cast(pl.Float64)).abs().max()
            text += f" by up to {largest:.3g}" if isinstance(largest, float) else ""
        parts.append(text)
    return f"columns differ: {', '.join(parts)}" if parts else "equal content, other bytes"


def _texts(first: Path, second: Path) -> str:
    try:
        one, other = (it.read_text(encoding="utf-8").splitlines() for it in (first, second))
    except UnicodeDecodeError:
        return f"{first.stat().st_size} and {second.stat().st_size} bytes differ"
    for number, (mine, its) in enumerate(zip(one, other, strict=False), start=1):
        if mine != its:
            place = next(
                (i for i, both in enumerate(zip(mine, its, strict=False)) if both[0] != both[1]),
                min(len(mine), len(its)),
            )
            start = max(0, place - 20)
            return (
                f"line {number}: {mine[start : place + 20]!r} instead of "
                f"{its[start : place + 20]!r} in the new results"
            )
    return f"{len(one)} and {len(other)} lines"
