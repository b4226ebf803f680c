"""Breaks the standard in one place after the other; the golden vectors must notice each time.

`python mutate.py [DIRECTORY]` works on a copy of the workspace in DIRECTORY (a temporary one).
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[4]
SOURCE = Path("crates/nr-ssb/src/standard")
# File, what stands there, what is put in its place.
MUTATIONS = [
    ("sequence/pss.rs", "[0, 1, 1, 0, 1, 1, 1]", "[0, 1, 1, 0, 1, 1, 0]"),
    ("sequence/pss.rs", "43 *", "42 *"),
    ("sequence/sss.rs", "15 * (n_id_1 / 112)", "16 * (n_id_1 / 112)"),
    ("sequence/sss.rs", "+ 5 *", "+ 4 *"),
    ("sequence/sss.rs", "n_id_1 % 112", "n_id_1 % 111"),
    ("sequence/dmrs.rs", "cell / 4 + 1)) << 11", "cell / 4 + 1)) << 10"),
    ("sequence/dmrs.rs", "(i << 6)", "(i << 5)"),
    ("sequence/dmrs.rs", "+ cell % 4;", ";"),
    ("sequence/dmrs.rs", "+ 4 * u8::from(half_frame)", "+ 2 * u8::from(half_frame)"),
    ("sequence/gold.rs", "const NC: u32 = 1600", "const NC: u32 = 1599"),
    ("sequence/gold.rs", "(x >> 2) ^ (x >> 1)", "(x >> 2) ^ (x >> 4)"),
    ("message/payload.rs", "16, 23, 18, 17, 8,", "16, 23, 17, 18, 8,"),
    ("message/payload.rs", "9, 11, 12, 13, 14, 15, 19", "11, 9, 12, 13, 14, 15, 19"),
    ("message/payload.rs", "const SFN_BIT_2: u8 = G[7]", "const SFN_BIT_2: u8 = G[6]"),
    ("message/payload.rs", "[G[11], G[12], G[13]]", "[G[11], G[12], G[14]]"),
    ("coding/rate_matching.rs", "0, 1, 2, 4, 3, 5", "0, 1, 2, 3, 4, 5"),
    ("coding/polar/code.rs", "247, 253,", "251, 253,"),
    ("coding/polar/code.rs", "0, 2, 3, 5, 7, 10,", "0, 3, 2, 5, 7, 10,"),
    ("pbch/encode.rs", "u32::from(v) * E", "u32::from(v + 1) * E"),
    ("numerology/case.rs", "14 * (i / 2) + 2 + 6", "14 * (i / 2) + 4 + 6"),
    ("numerology/case.rs", "12 * (i / 2 % 2)", "8 * (i / 2 % 2)"),
    ("grid/indices.rs", "56..56 + SYNC_LEN", "57..57 + SYNC_LEN"),
    ("../raster/point.rs", "7499 + n", "7498 + n"),
    ("../raster/point.rs", "1.44e6", "1.2e6"),
]


def main() -> int:
    place = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()) / "mutated"
    shutil.copytree(ROOT, place, ignore=shutil.ignore_patterns("target", ".git", ".venv"))
    # Without any data: what is caught must be caught by the crate alone.
    environment = dict(os.environ, ACCESS_AV_DATA="/nonexistent")
    environment["CARGO_TARGET_DIR"] = str(place.parent / "target")

    def caught() -> bool:
        command = ["cargo", "test", "--quiet", "--offline", "-p", "nr-ssb", "--test", "golden"]
        done = subprocess.run(command, cwd=place, env=environment, capture_output=True, text=True)
        if done.returncode and not re.search("test result: FAILED", done.stdout):
            # It does not even compile: that is caught too, but by no test.
            assert "error" in done.stderr, done.stderr
            print("  (by the compiler)", end="")
        return done.returncode != 0

    assert not caught(), "unbroken, it must pass"
    missed = 0
    for name, old, new in MUTATIONS:
        file = place / SOURCE / name
        text = file.read_text(encoding="utf-8")
        assert text.count(old) >= 1, (name, old)
        file.write_text(text.replace(old, new, 1), encoding="utf-8")
        found = caught()
        file.write_text(text, encoding="utf-8")
        missed += not found
        print("caught" if found else "MISSED", name, repr(old), "->", repr(new), flush=True)
    print(len(MUTATIONS) - missed, "of", len(MUTATIONS), "caught")
    shutil.rmtree(place)
    return missed


if __name__ == "__main__":
    sys.exit(main())
