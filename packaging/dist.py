"""Distribution: wheels, node binaries and Debian packages for x86-64 and aarch64.

    python packaging/dist.py [--target aarch64] [--thin] [--out dist]

Everything is linked with Zig against glibc 2.17 (manylinux2014), so that one build runs on every
Linux distribution since 2014, JetPack included. Tools: `pip install maturin ziglang
cargo-zigbuild`, and a Rust standard library for each target, by one of:

    rustup target add aarch64-unknown-linux-gnu
    dpkg --add-architecture arm64; apt-get install rustc-web cargo-web libstd-rust-web-dev:arm64

Prints every file that was built and every one that was not, with the missing tool. Exit code 1: a
file was not built.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import deb

ROOT = Path(__file__).parents[1]
TARGETS = {
    "x86_64": ("x86_64-unknown-linux-gnu", "amd64"),
    "aarch64": ("aarch64-unknown-linux-gnu", "arm64"),
}
COMPATIBILITY = "manylinux2014"
# Commands that compile: the default ones (rustup), then those of Debian.
TOOLCHAINS = (("rustc", "cargo"), ("/usr/bin/rustc", "/usr/bin/cargo"))


class Toolchain(NamedTuple):
    """Compiler and package manager of Rust."""

    rustc: str
    cargo: str

    def environment(self, *, thin: bool) -> dict[str, str]:
        """Environment of a build."""
        changed = {
            "RUSTC": self.rustc,
            "CARGO": self.cargo,
            "CARGO_PROFILE_RELEASE_STRIP": "symbols",
            "CARGO_PROFILE_RELEASE_LTO": "fat",
        }
        if thin:
            changed |= {"CARGO_PROFILE_RELEASE_LTO": "thin"}
            changed |= {"CARGO_PROFILE_RELEASE_CODEGEN_UNITS": "16"}
        scripts = str(Path(sys.executable).parent)
        return {**os.environ, **changed, "PATH": f"{scripts}:{os.environ['PATH']}"}


def toolchain(target: str) -> Toolchain | None:
    """The first toolchain that has a standard library for a target."""
    for rustc, cargo in TOOLCHAINS:
        found = shutil.which(rustc), shutil.which(cargo)
        if None in found:
            continue
        query = [rustc, "--print", "target-libdir", "--target", target]
        done = subprocess.run(query, capture_output=True, text=True, check=False)
        folder = Path(done.stdout.strip() or "/nonexistent")
        if done.returncode == 0 and any(folder.glob("libstd-*")):
            return Toolchain(str(found[0]), str(found[1]))
    return None


def missing_tools() -> list[str]:
    """Python packages that are needed and not installed."""
    packages = {"maturin": "maturin", "ziglang": "ziglang"}
    missing = [name for name, module in packages.items() if not importlib.util.find_spec(module)]
    beside = Path(sys.executable).parent / "cargo-zigbuild"
    if not beside.exists() and shutil.which("cargo-zigbuild") is None:
        missing.append("cargo-zigbuild")
    return missing


def build(name: str, out: Path, *, thin: bool) -> tuple[list[Path], list[str]]:
    """Builds everything of a target; returns the files, and the reasons for those not built."""
    target, architecture = TARGETS[name]
    tools = missing_tools()
    if tools:
        return [], [f"{name}: missing {', '.join(tools)}: pip install {' '.join(tools)}"]
    compilers = toolchain(target)
    if compilers is None:
        return [], [f"{name}: no Rust standard library for {target}: rustup target add {target}"]
    environment = compilers.environment(thin=thin)
    built: list[Path] = []
    failed: list[str] = []

    def run(what: str, *command: str) -> bool:
        print(f"{name}: {what}: {' '.join(command)}", flush=True)
        done = subprocess.run(command, cwd=ROOT, env=environment, check=False)
        if done.returncode:
            failed.append(f"{name}: {what}: exit code {done.returncode}; its messages are above")
        return done.returncode == 0

    before = set(out.glob("*.whl"))
    maturin = (sys.executable, "-m", "maturin", "build", "--release", "--zig")
    options = ("--compatibility", COMPATIBILITY, "--target", target, "--out", str(out))
    if run("wheel", *maturin, *options):
        built += sorted(set(out.glob("*.whl")) - before)
    zigbuild = ("cargo-zigbuild", "zigbuild", "--release", "--package", "access-av-node")
    if run("node", *zigbuild, "--target", f"{target}.{deb.LIBC}"):
        program = out / f"access-av-node-{target}"
        shutil.copy(ROOT / "target" / target / "release/access-av-node", program)
        built.append(program)
        if shutil.which("dpkg-deb"):
            built.append(deb.build(program, architecture, out))
        else:
            failed.append(f"{name}: Debian package: no dpkg-deb")
    return built, failed


def main() -> int:
    """Builds all targets."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--target", choices=TARGETS, help="one target only [both]")
    options.add_argument("--thin", action="store_true", help="thin link-time optimization: faster")
    options.add_argument("--out", type=Path, default=ROOT / "dist", help="folder [dist]")
    chosen = options.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    built: list[Path] = []
    failed: list[str] = []
    for name in [chosen.target] if chosen.target else TARGETS:
        files, reasons = build(name, chosen.out, thin=chosen.thin)
        built += files
        failed += reasons
    for file in built:
        print(f"built: {file} ({file.stat().st_size / 1e6:.1f} MB)")
    for reason in failed:
        print(f"not built: {reason}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
