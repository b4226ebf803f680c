"""Debian package of the node: contents, metadata, unit and example settings."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT
from node import NODE

SERVICE = "usr/lib/systemd/system/access-av-node.service"
SETTINGS = ("node.toml", "site.toml", "vehicle.toml")

pytestmark = pytest.mark.skipif(shutil.which("dpkg-deb") is None, reason="no dpkg-deb")


def built(folder: Path) -> Path:
    """A package whose program is a script."""
    program = folder / "program"
    program.write_text("#!/bin/sh\nexit 0\n", encoding="utf-8")
    command = [sys.executable, str(ROOT / "packaging/deb.py"), "--binary", str(program)]
    command += ["--architecture", "arm64", "--out", str(folder / "dist")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return Path(done.stdout.strip())


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(tmp_path_factory.mktemp("package"))


@pytest.fixture(scope="module")
def root(package: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("root")
    subprocess.run(["dpkg-deb", "--raw-extract", str(package), str(folder)], check=True, timeout=60)
    return folder


def test_packaged_files_have_the_specified_paths_modes_and_owner(package: Path) -> None:
    listing = subprocess.run(
        ["dpkg-deb", "--contents", str(package)],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    ).stdout
    rows = [line.split() for line in listing.splitlines()]
    modes = {row[5].removeprefix("./"): row[0] for row in rows}
    assert {row[1] for row in rows} == {"root/root"}
    assert modes["usr/bin/access-av-node"] == "-rwxr-xr-x"
    documents = [f"usr/share/doc/access-av-node/{name}" for name in ("node.md", "copyright")]
    settings = [f"etc/access-av/{name}" for name in SETTINGS]
    for name in (SERVICE, "usr/lib/sysusers.d/access-av.conf", *documents, *settings):
        assert modes[name] == "-rw-r--r--", name
    folders = {mode for name, mode in modes.items() if name.endswith("/")}
    assert folders == {"drwxr-xr-x"}


def test_metadata_names_architecture_version_and_settings(package: Path, root: Path) -> None:
    fields = ("Package", "Version", "Architecture")
    shown = subprocess.run(
        ["dpkg-deb", "--show", "--showformat", "\n".join(f"${{{it}}}" for it in fields), package],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    ).stdout.split()
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert shown == ["access-av-node", re.findall(r'^version = "(.+)"', project, re.M)[0], "arm64"]
    kept = (root / "DEBIAN/conffiles").read_text(encoding="utf-8").split()
    assert kept == [f"/etc/access-av/{name}" for name in SETTINGS]
    sums = (root / "DEBIAN/md5sums").read_text(encoding="utf-8")
    checked = subprocess.run(
        ["md5sum", "--check", "--strict"], input=sums, text=True, cwd=root, capture_output=True
    )
    assert checked.returncode == 0, checked.stdout
    for name in ("postinst", "prerm", "postrm"):
        script = root / "DEBIAN" / name
        assert script.stat().st_mode & 0o111
        assert subprocess.run(["sh", "-n", str(script)]).returncode == 0


def test_equal_input_gives_an_equal_package(package: Path, tmp_path: Path) -> None:
    assert built(tmp_path).read_bytes() == package.read_bytes()


def test_the_systemd_unit_has_the_required_settings(root: Path) -> None:
    unit = (root / SERVICE).read_text(encoding="utf-8")
    values = dict(re.findall(r"^([A-Za-z]+)=(.*)$", unit, re.M))
    required = {
        "Type": "notify",
        "User": "access-av",
        "StateDirectory": "access-av",
        "LogsDirectory": "access-av",
        "CPUSchedulingPolicy": "fifo",
        "WatchdogSec": "2",
        "Restart": "on-failure",
        "NoNewPrivileges": "yes",
        "ProtectSystem": "strict",
    }
    assert {key: values.get(key) for key in required} == required


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze")
def test_the_systemd_unit_is_accepted_by_systemd(root: Path, tmp_path: Path) -> None:
    # The program has another path without installation; all other items are verified as installed.
    unit = (root / SERVICE).read_text(encoding="utf-8")
    program = root / "usr/bin/access-av-node"
    verified = tmp_path / "access-av-node.service"
    verified.write_text(unit.replace("/usr/bin/access-av-node", str(program)), encoding="utf-8")
    done = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", "--recursive-errors=no", str(verified)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    assert "access-av-node.service" not in done.stderr, done.stderr


@pytest.mark.skipif(not NODE.exists(), reason=f"no {NODE}: `cargo build -p access-av-node`")
def test_example_settings_are_accepted_by_the_node(root: Path) -> None:
    folder = root / "etc/access-av"
    files = ["--site", str(folder / "site.toml"), "--vehicle", str(folder / "vehicle.toml")]
    done = subprocess.run(
        [str(NODE), *files, str(folder / "node.toml"), "--dry-run"],
        capture_output=True,
        text=True,
        timeout=30,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "ready"
    assert "warning" not in done.stdout, done.stdout
