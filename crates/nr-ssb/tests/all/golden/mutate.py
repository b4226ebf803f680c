"""Mutation test: changes one constant of the standard at a time; the golden vectors must fail.

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
    ("sequence/pss.rs", "0, 1, 1, 1], 4)", "0, 1, 1, 1], 3)"),
    ("sequence/pss.rs", "43 *", "42 *"),
    ("sequence/sss.rs", "0, 0, 0, 0], 4)", "0, 0, 0, 0], 3)"),
    ("sequence/sss.rs", "0, 0, 0, 0], 1)", "0, 0, 0, 0], 6)"),
    ("sequence/sss.rs", "15 * (n_id_1 / 112)", "16 * (n_id_1 / 112)"),
    ("sequence/sss.rs", "+ 5 *", "+ 4 *"),
    ("sequence/sss.rs", "n_id_1 % 112", "n_id_1 % 111"),
    ("sequence/dmrs.rs", "cell / 4 + 1)) << 11", "cell / 4 + 1)) << 10"),
    ("sequence/dmrs.rs", "(i << 6)", "(i << 5)"),
    ("sequence/dmrs.rs", "+ cell % 4;", ";"),
    ("sequence/dmrs.rs", "+ 4 * u8::from(half_frame)", "+ 2 * u8::from(half_frame)"),
    ("sequence/dmrs.rs", "Lmax::L64 => ssb_index & 7", "Lmax::L64 => ssb_index & 3"),
    ("sequence/gold.rs", "const NC: u32 = 1600", "const NC: u32 = 1599"),
    ("sequence/gold.rs", "((x >> 3) ^ x) & STEP", "((x >> 2) ^ x) & STEP"),
    ("sequence/gold.rs", "(x >> 2) ^ (x >> 1)", "(x >> 2) ^ (x >> 4)"),
    ("sequence/modulation.rs", "Complex32::new(re, im)", "Complex32::new(im, re)"),
    ("message/mib.rs", "0x3F) << 17", "0x3F) << 18"),
    ("message/mib.rs", "bits >> 12 & 0xF", "bits >> 13 & 0xF"),
    ("message/mib.rs", "self.pdcch_config_sib1 >> 4", "self.pdcch_config_sib1 >> 3"),
    ("message/mib.rs", "cell_barred: !bit(2)", "cell_barred: bit(2)"),
    ("message/crc.rs", "0xB2_B117", "0xB2_B113"),
    ("message/payload.rs", "16, 23, 18, 17, 8,", "16, 23, 17, 18, 8,"),
    ("message/payload.rs", "9, 11, 12, 13, 14, 15, 19", "11, 9, 12, 13, 14, 15, 19"),
    ("message/payload.rs", "const SFN_BIT_2: u8 = G[7]", "const SFN_BIT_2: u8 = G[6]"),
    ("message/payload.rs", "const HALF_FRAME: u8 = G[10]", "const HALF_FRAME: u8 = G[9]"),
    ("message/payload.rs", "[G[11], G[12], G[13]]", "[G[11], G[12], G[14]]"),
    ("message/payload.rs", "2 * bit(SFN_BIT_2) + bit(", "bit(SFN_BIT_2) + 2 * bit("),
    ("message/payload.rs", "let scrambled_count = clear.count_zeros()", "let scrambled_count = 32"),
    ("message/payload.rs", "self.ssb_index >> 3 & 7", "self.ssb_index >> 2 & 7"),
    ("coding/rate_matching.rs", "0, 1, 2, 4, 3, 5", "0, 1, 2, 3, 4, 5"),
    ("coding/polar/code.rs", "247, 253,", "251, 253,"),
    ("coding/polar/code.rs", "0, 2, 3, 5, 7, 10,", "0, 3, 2, 5, 7, 10,"),
    ("pbch/encode.rs", "u32::from(v) * E", "u32::from(v + 1) * E"),
    ("pbch/encode.rs", "u32::from(pci.get()),", "u32::from(pci.get()) + 1,"),
    ("numerology/burst_set.rs", "Self::L8 | Self::L64 => ssb_index & 7", "_ => ssb_index & 3"),
    ("numerology/case.rs", "14 * (i / 2) + 2 + 6", "14 * (i / 2) + 4 + 6"),
    ("numerology/case.rs", "28 * (i / 4) + 12", "28 * (i / 4) + 8"),
    ("numerology/case.rs", "28 * n(4) + 12", "28 * n(4) + 8"),
    ("numerology/case.rs", "56 * n(8) + 24", "56 * n(8) + 28"),
    ("numerology/case.rs", "i / (4 * per_n)", "i / (5 * per_n)"),
    ("numerology/sampling.rs", "self.fft_size / 128 *", "self.fft_size / 64 *"),
    ("numerology/sampling.rs", "9 * (self.fft_size / 128)", "8 * (self.fft_size / 128)"),
    ("grid/indices.rs", "56..56 + SYNC_LEN", "57..57 + SYNC_LEN"),
    ("grid/indices.rs", "480..528, 672..720", "480..524, 668..720"),
    ("grid/indices.rs", "(index % 4 == v)", "((index + 1) % 4 == v)"),
    ("band/table.rs", "Steps(7711, 1, 8051)", "Steps(7711, 1, 8061)"),
    ("band/table.rs", "Steps(22388, 1, 22558)", "Steps(22387, 1, 22558)"),
    ("../raster/point.rs", "7499 + n", "7498 + n"),
    ("../raster/point.rs", "1.44e6", "1.2e6"),
    ("../raster/point.rs", "3 * n + (m - 1) / 2 - 1", "3 * n + (m - 1) / 2"),
    ("../raster/point.rs", "17.28e6", "17.2e6"),
]


def main() -> int:
    place = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()) / "mutated"
    shutil.copytree(ROOT, place, ignore=shutil.ignore_patterns("target", ".git", ".venv"))
    # Without any data: what is caught must be caught by the crate alone.
    environment = dict(os.environ, ACCESS_AV_DATA="/nonexistent")
    environment["CARGO_TARGET_DIR"] = str(place.parent / "target")
    environment["CARGO_PROFILE_DEV_OPT_LEVEL"] = "0"

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
