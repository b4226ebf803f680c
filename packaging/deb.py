"""Debian package of `access-av-node`, built with `dpkg-deb`.

    python packaging/deb.py --binary target/release/access-av-node --architecture amd64 --out dist

Installs the program, the systemd unit, the system user, example settings in /etc/access-av
(configuration files: an update keeps changed ones) and the documentation. Prints the path of the
package. Exit code 2: the binary is missing or `dpkg-deb` failed.
"""

from __future__ import annotations

import argparse
import gzip
import hashlib
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCES = Path(__file__).parent
NAME = "access-av-node"
# Settings that belong to the user after the installation.
SETTINGS = ("node.toml", "site.toml", "vehicle.toml")
DOCUMENTS = ("node.md", "install-jetson.md", "install-usrp.md", "integrity.md")
SCRIPTS = ("postinst", "prerm", "postrm")
# Minimum version of the C library with which the program runs: `make dist` links against 2.17.
LIBC = "2.17"
DEPENDS = f"libc6 (>= {LIBC}), libgcc-s1"
# Time stamp of all files (s), so that equal input gives an equal package.
EPOCH_S = 1_700_000_000


def version() -> str:
    """Version of the project."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    found = re.search(r'^version = "(.+)"$', text, re.MULTILINE)
    assert found is not None
    return found.group(1)


def control(architecture: str, installed_kib: int, depends: str) -> str:
    """`DEBIAN/control` (deb-control(5))."""
    return f"""\
Package: {NAME}
Version: {version()}
Architecture: {architecture}
Maintainer: ACCESS-AV authors <access-av@localhost>
Installed-Size: {installed_kib}
Depends: {depends}
Recommends: systemd
Section: net
Priority: optional
Description: locates a factory vehicle from 5G SSBs
 Receives samples of several antennas and odometry, estimates angles of arrival of the SSBs of a
 private 5G network, and provides pose, covariance, protection level and state as newline JSON,
 MCAP, MQTT (VDA 5050) and a web page. Runs as a systemd service.
"""


def lay_out(root: Path, binary: Path, architecture: str, depends: str) -> None:
    """Writes the tree of the package into a folder."""
    files: list[tuple[Path, str, int]] = [
        (binary, f"usr/bin/{NAME}", 0o755),
        (SOURCES / f"{NAME}.service", f"usr/lib/systemd/system/{NAME}.service", 0o644),
        (SOURCES / "sysusers.conf", "usr/lib/sysusers.d/access-av.conf", 0o644),
        *((SOURCES / "etc" / name, f"etc/access-av/{name}", 0o644) for name in SETTINGS),
        *((ROOT / "docs" / name, f"usr/share/doc/{NAME}/{name}", 0o644) for name in DOCUMENTS),
        (ROOT / "LICENSE-MIT", f"usr/share/doc/{NAME}/copyright", 0o644),
        *((SOURCES / "debian" / name, f"DEBIAN/{name}", 0o755) for name in SCRIPTS),
    ]
    for source, place, mode in files:
        target = root / place
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)
        target.chmod(mode)
    changes = (ROOT / "CHANGELOG.md").read_bytes()
    changelog = root / f"usr/share/doc/{NAME}/changelog.gz"
    changelog.write_bytes(gzip.compress(changes, 9, mtime=EPOCH_S))
    installed = [it for it in root.rglob("*") if it.is_file() and "DEBIAN" not in it.parts]
    size_kib = sum(it.stat().st_size + 1023 for it in installed) // 1024
    debian = root / "DEBIAN"
    written = {
        "control": control(architecture, size_kib, depends),
        "conffiles": "".join(f"/etc/access-av/{name}\n" for name in SETTINGS),
        "md5sums": "".join(
            f"{hashlib.md5(it.read_bytes()).hexdigest()}  {it.relative_to(root)}\n"
            for it in sorted(installed)
        ),
    }
    for name, text in written.items():
        (debian / name).write_text(text, encoding="utf-8")
        (debian / name).chmod(0o644)
    for folder in [root, *(it for it in root.rglob("*") if it.is_dir())]:
        folder.chmod(0o755)


def build(binary: Path, architecture: str, out: Path, depends: str = DEPENDS) -> Path:
    """Builds the package; returns its path."""
    out.mkdir(parents=True, exist_ok=True)
    package = out / f"{NAME}_{version()}_{architecture}.deb"
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch) / "root"
        lay_out(root, binary, architecture, depends)
        command = ["dpkg-deb", "--root-owner-group", "-Zxz", "--build", str(root), str(package)]
        environment = {"SOURCE_DATE_EPOCH": str(EPOCH_S), "PATH": "/usr/bin:/bin"}
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if done.returncode:
        sys.exit(f"error: dpkg-deb: {done.stderr.strip()}")
    return package


def main() -> None:
    """Builds one package."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--binary", type=Path, required=True, help="program for the architecture")
    options.add_argument("--architecture", choices=("amd64", "arm64"), required=True)
    options.add_argument("--out", type=Path, default=ROOT / "dist", help="folder [dist]")
    options.add_argument("--depends", default=DEPENDS, help=f"packages it needs [{DEPENDS}]")
    chosen = options.parse_args()
    if not chosen.binary.is_file():
        print(
            f"error: --binary {chosen.binary}: no such file; `make dist` builds it", file=sys.stderr
        )
        sys.exit(2)
    print(build(chosen.binary, chosen.architecture, chosen.out, chosen.depends))


if __name__ == "__main__":
    main()
