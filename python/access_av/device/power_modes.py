"""Power modes of the computer by nvpmodel or cpufreq; without both, the present mode."""

from __future__ import annotations

import re
import signal
import subprocess
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

# Maximum number of cpufreq clocks to measure.
MOST_CLOCKS = 5
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@dataclass(frozen=True)
class Mode:
    """A power mode; its clock in MHz."""

    number: int
    name: str
    cpu_mhz: float
    cores: int


class ModeError(InputError):
    """A mode that cannot be selected."""


@dataclass(frozen=True)
class Board:
    """Power modes of a computer and their selection.

    Attributes
    ----------
    kind
        ``nvpmodel``, ``cpufreq`` or ``present``.
    """

    kind: str
    modes: tuple[Mode, ...]
    sysfs: Path

    def switch(self, mode: Mode) -> None:
        """Selects a mode.

        Raises
        ------
        ModeError
            Mode that cannot be selected, for example because it needs a reboot.
        """
        if self.kind == "nvpmodel":
            _nvpmodel("-m", str(mode.number))
            if _present_nvpmodel() != mode.number:
                raise ModeError(
                    f"mode {mode.number} ({mode.name}) needs a reboot: it is not measured"
                )
        elif self.kind == "cpufreq":
            for policy in _policies(self.sysfs):
                _write(policy / "scaling_max_freq", str(round(mode.cpu_mhz * 1e3)))

    @contextmanager
    def restored(self) -> Iterator[None]:
        """Restores the original mode on exit, also after signals."""
        if self.kind == "present":
            yield
            return
        found_mode = _present_nvpmodel() if self.kind == "nvpmodel" else None
        found = {
            file: file.read_text(encoding="utf-8")
            for policy in _policies(self.sysfs)
            if self.kind == "cpufreq"
            for file in [policy / "scaling_max_freq"]
        }
        before = {number: signal.signal(number, _interrupt) for number in ENDING}
        try:
            yield
        finally:
            for number in ENDING:
                signal.signal(number, signal.SIG_IGN)
            try:
                if found_mode is not None and _present_nvpmodel() != found_mode:
                    _nvpmodel("-m", str(found_mode))
                for file, text in found.items():
                    _write(file, text)
            finally:
                for number, handler in before.items():
                    signal.signal(number, handler)


def find(root: Path, sysfs: Path, cpu_mhz: float | None = None) -> Board:
    """Finds the power modes of the computer with these ``/`` and ``/sys`` folders.

    ``cpu_mhz`` is the clock if the computer does not report it.

    Raises
    ------
    InputError
        Unknown clock.
    """
    limits = [policy / "cpuinfo_max_freq" for policy in _policies(sysfs)]
    khz = [float(file.read_text(encoding="utf-8")) for file in limits if file.is_file()]
    limit_mhz = max(khz) * 1e-3 if khz else None
    most_mhz = cpu_mhz or limit_mhz or _cpuinfo_mhz(root) or _cpuinfo_mhz(Path("/"))
    if most_mhz is None:
        raise InputError("the CPU clock of this computer is unknown; add --cpu-mhz")
    file = root / "etc/nvpmodel.conf"
    if file.is_file():
        modes = parse_nvpmodel(file.read_text(encoding="utf-8", errors="replace"), most_mhz)
        if modes:
            return Board("nvpmodel", tuple(modes), sysfs)
    cores = max(len(list(sysfs.glob("devices/system/cpu/cpu[0-9]*"))), 1)
    clocks = _clocks(sysfs)
    writable = all(_is_writable(policy / "scaling_max_freq") for policy in _policies(sysfs))
    if len(clocks) > 1 and writable:
        modes = [
            Mode(number, f"{clock:.0f} MHz", clock, cores) for number, clock in enumerate(clocks)
        ]
        return Board("cpufreq", tuple(modes), sysfs)
    return Board("present", (Mode(0, "present", most_mhz, cores),), sysfs)


def parse_nvpmodel(text: str, most_mhz: float) -> list[Mode]:
    """Parses the power modes of an ``nvpmodel.conf``.

    Parameters
    ----------
    text
        The file.
    most_mhz
        Limit of the CPU, for modes without a limit (``MAX_FREQ -1``).

    Examples
    --------
    >>> parse_nvpmodel('''< POWER_MODEL ID=2 NAME=MODE_15W >
    ... CPU_ONLINE CORE_0 1
    ... CPU_ONLINE CORE_1 0
    ... CPU_DENVER_0 MAX_FREQ 1200000''', most_mhz=2265.6)
    [Mode(number=2, name='MODE_15W', cpu_mhz=1200.0, cores=1)]
    """
    modes = []
    for block in re.split(r"<\s*POWER_MODEL\s+", text)[1:]:
        head = re.match(r"ID=(\d+)\s+NAME=(\S+)\s*>", block)
        if head is None:
            continue
        limits_khz = [int(value) for value in re.findall(r"^CPU\S* MAX_FREQ (-?\d+)", block, re.M)]
        online = re.findall(r"^CPU_ONLINE CORE_\d+ 1\s*$", block, re.M)
        modes.append(
            Mode(
                number=int(head[1]),
                name=head[2],
                cpu_mhz=max(limits_khz) * 1e-3 if limits_khz and -1 not in limits_khz else most_mhz,
                cores=max(len(online), 1),
            )
        )
    return modes


def chosen(board: Board, numbers: list[int] | None) -> list[Mode]:
    """Returns the modes with these numbers, or all.

    Raises
    ------
    InputError
        Unknown mode.
    """
    by_number: Mapping[int, Mode] = {mode.number: mode for mode in board.modes}
    for number in numbers or []:
        if number not in by_number:
            there = ", ".join(map(str, by_number))
            raise InputError(f"--mode {number}: unknown power mode; this computer has {there}")
    return [by_number[number] for number in numbers] if numbers else list(board.modes)


def _interrupt(number: int, _frame: Any) -> None:
    raise KeyboardInterrupt(f"signal {number}")


def _nvpmodel(*arguments: str) -> str:
    try:
        done = subprocess.run(
            ["nvpmodel", *arguments],
            input="NO\n",
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ModeError(f"nvpmodel {' '.join(arguments)}: {error}") from error
    return done.stdout


def _present_nvpmodel() -> int:
    said = _nvpmodel("-q")
    numbers = re.findall(r"^\s*(\d+)\s*$", said, re.M)
    if not numbers:
        raise ModeError(f"nvpmodel -q: no power mode in the output {said.strip()!r}")
    return int(numbers[-1])


def _policies(sysfs: Path) -> list[Path]:
    return sorted(sysfs.glob("devices/system/cpu/cpufreq/policy*")) or sorted(
        sysfs.glob("devices/system/cpu/cpu[0-9]*/cpufreq")
    )


def _clocks(sysfs: Path) -> list[float]:
    """Returns evenly spread clocks of cpufreq in MHz, the fastest first."""
    offered: set[int] = set()
    for policy in _policies(sysfs):
        file = policy / "scaling_available_frequencies"
        if file.is_file():
            offered |= {int(text) for text in file.read_text(encoding="utf-8").split()}
    ordered = sorted(offered, reverse=True)
    if len(ordered) > MOST_CLOCKS:
        last = len(ordered) - 1
        ordered = [ordered[round(i * last / (MOST_CLOCKS - 1))] for i in range(MOST_CLOCKS)]
    return [khz * 1e-3 for khz in ordered]


def _cpuinfo_mhz(root: Path) -> float | None:
    file = root / "proc/cpuinfo"
    text = file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""
    clocks = [float(mhz) for mhz in re.findall(r"^cpu MHz\s*:\s*([\d.]+)", text, re.M)]
    return max(clocks, default=None)


def _is_writable(file: Path) -> bool:
    try:
        with file.open("r+", encoding="utf-8"):
            return True
    except OSError:
        return False


def _write(file: Path, text: str) -> None:
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ModeError(f"{file}: {error.strerror}") from error
