"""Golden vectors of the SSB, written from the standard's text alone: `python make.py > golden.txt`.

TS 38.211 (sequences, mapping), 38.212 (payload, CRC, polar code, rate matching), 38.213 (cases),
38.104 (raster). Bit by bit and slow: nothing is shared with the crate, nor copied from elsewhere.
`python make.py --check DIR` compares it with vectors of other encoders (`sequences.npz`,
`pbch.npz`).
"""

import sys

# TS 38.212 Table 5.3.1.2-1: bit channels of N = 512 from the least reliable on, the last 56 sorted.
# (These entries are copied from the table of the standard. No construction rule produces them.)
INFORMATION = """
247 253 254 255 367 375 379 381 382 383 415 431 439 441 443 444 445 446 447 463 469 470 471 473
474 475 476 477 478 479 483 485 486 487 489 490 491 492 493 494 495 497 498 499 500 501 502 503
504 505 506 507 508 509 510 511
"""
# TS 38.212 Table 5.3.1.1-1: the interleaving pattern for K_max = 164.
PATTERN = """
0 2 4 7 9 14 19 20 24 25 26 28 31 34 42 45 49 50 51 53 54 56 58 59 61 62 65 66 67 69 70 71 72 76
77 81 82 83 87 88 89 91 93 95 98 101 104 106 108 110 111 113 115 118 119 120 122 123 126 127 129
132 134 138 139 140 1 3 5 8 10 15 21 27 29 32 35 43 46 52 55 57 60 63 68 73 78 84 90 92 94 96 99
102 105 107 109 112 114 116 121 124 128 130 133 135 141 6 11 16 22 30 33 36 44 47 64 74 79 85 97
100 103 117 125 131 136 142 12 17 23 37 48 75 80 86 137 143 13 18 38 144 39 145 40 146 41 147 148
149 150 151 152 153 154 155 156 157 158 159 160 161 162 163
"""
# TS 38.212 Table 5.4.1.1-1 and Table 7.1.1-1.
SUB_BLOCKS = [0, 1, 2, 4, 3, 5, 6, 7, 8, 16, 9, 17, 10, 18, 11, 19,
              12, 20, 13, 21, 14, 22, 15, 23, 24, 25, 26, 28, 27, 29, 30, 31]  # fmt: skip
G = [16, 23, 18, 17, 8, 30, 10, 6, 24, 7, 0, 5, 3, 2, 1, 4,
     9, 11, 12, 13, 14, 15, 19, 20, 21, 22, 25, 26, 27, 28, 29, 31]  # fmt: skip


def recursion(start, taps, length):
    """x(i + n) = Σ x(i + tap) mod 2, n = len(start)."""
    x = list(start)
    while len(x) < length:
        x.append(sum(x[len(x) - len(start) + tap] for tap in taps) % 2)
    return x


def gold(c_init, length):
    """c(n) of TS 38.211, 5.2.1."""
    x1 = recursion([1] + [0] * 30, [3, 0], 1600 + length)
    x2 = recursion([c_init >> i & 1 for i in range(31)], [3, 2, 1, 0], 1600 + length)
    return [(a + b) % 2 for a, b in zip(x1[1600:], x2[1600:])]


def pss(n_id_2):
    x = recursion([0, 1, 1, 0, 1, 1, 1], [4, 0], 127)
    return [x[(n + 43 * n_id_2) % 127] for n in range(127)]


def sss(pci):
    n1, n2 = divmod(pci, 3)
    x0 = recursion([1, 0, 0, 0, 0, 0, 0], [4, 0], 127)
    x1 = recursion([1, 0, 0, 0, 0, 0, 0], [1, 0], 127)
    m0, m1 = 15 * (n1 // 112) + 5 * n2, n1 % 112
    return [(x0[(n + m0) % 127] + x1[(n + m1) % 127]) % 2 for n in range(127)]


def dmrs(pci, i):
    """The 288 bits that become 144 QPSK symbols."""
    return gold(2**11 * (i + 1) * (pci // 4 + 1) + 2**6 * (i + 1) + pci % 4, 288)


def elements(pci):
    """Flat indices k + 240 l of the PBCH and of its DM-RS (TS 38.211 Table 7.4.3.1-1)."""
    area = [240 * 1 + k for k in range(240)]
    area += [240 * 2 + k for k in list(range(48)) + list(range(192, 240))]
    area += [240 * 3 + k for k in range(240)]
    pilots = [i for i in area if i % 240 % 4 == pci % 4]
    return [i for i in area if i not in set(pilots)], pilots


def crc24c(bits):
    """The remainder of division by D^24+D^23+D^21+D^20+D^17+D^15+D^13+D^12+D^8+D^4+D^2+D+1."""
    powers = [24, 23, 21, 20, 17, 15, 13, 12, 8, 4, 2, 1, 0]
    rest = list(bits) + [0] * 24
    for i in range(len(bits)):
        if rest[i]:
            for power in powers:
                rest[i + 24 - power] ^= 1
    return rest[-24:]


def polar(message):
    k_max, k = 164, len(message)
    pattern = list(map(int, PATTERN.split()))
    order = [p - (k_max - k) for p in pattern if p >= k_max - k]
    u = [0] * 512
    for channel, place in zip(map(int, INFORMATION.split()), order):
        u[channel] = message[place]
    half = 1
    while half < 512:
        for first in range(0, 512, 2 * half):
            for i in range(first, first + half):
                u[i] ^= u[i + half]
        half *= 2
    return u


def pbch(cell):
    """The stages of one PBCH, as lists of bits."""
    mib, sfn, half, index, k_msb, pci, lmax = cell
    last = [index >> 5 & 1, index >> 4 & 1, index >> 3 & 1] if lmax == 64 else [k_msb, 0, 0]
    plain = list(mib) + [sfn >> i & 1 for i in (3, 2, 1, 0)] + [half] + last
    payload, j_sfn, j_other = [0] * 32, 0, 14
    for i, bit in enumerate(plain):
        if 1 <= i <= 6 or 24 <= i <= 27:
            payload[G[j_sfn]] = bit
            j_sfn += 1
        elif i == 28:
            payload[G[10]] = bit
        elif i >= 29:
            payload[G[11 + i - 29]] = bit
        else:
            payload[G[j_other]] = bit
            j_other += 1
    # Not scrambled: half frame, the SFN's second and third least significant bits, the index.
    kept = {G[10], G[7], G[8]} | (set(G[11:14]) if lmax == 64 else set())
    v = 2 * (sfn >> 2 & 1) + (sfn >> 1 & 1)
    c = gold(pci, 4 * 32)
    scrambled, j = [], v * (32 - len(kept))
    for i, bit in enumerate(payload):
        if i in kept:
            scrambled.append(bit)
        else:
            scrambled.append(bit ^ c[j])
            j += 1
    coded = polar(scrambled + crc24c(scrambled))
    blocks = [coded[16 * SUB_BLOCKS[n // 16] + n % 16] for n in range(512)]
    matched = blocks + blocks[:352]
    v = index % 4 if lmax == 4 else index % 8
    c = gold(pci, (v + 1) * 864)[v * 864 :]
    sent = [a ^ b for a, b in zip(matched, c)]
    return payload, scrambled, crc24c(scrambled), coded, matched, sent


def cases():
    """First symbols (TS 38.213, 4.1)."""
    yield "A", [s + 14 * n for n in range(4) for s in (2, 8)]
    yield "B", [s + 28 * n for n in range(2) for s in (4, 8, 16, 20)]
    yield "C", [s + 14 * n for n in range(4) for s in (2, 8)]
    d = (0, 1, 2, 3, 5, 6, 7, 8, 10, 11, 12, 13, 15, 16, 17, 18)
    yield "D", [s + 28 * n for n in d for s in (4, 8, 16, 20)]
    yield "E", [s + 56 * n for n in d[:8] for s in (8, 12, 16, 20, 32, 36, 40, 44)]


def prefixes(khz):
    """(start, length) of the cyclic prefixes of a subframe (TS 38.211, 5.3.1), in samples of which
    an OFDM symbol has 256."""
    mu = {15: 0, 30: 1, 120: 3, 240: 4}[khz]
    start = 0
    for symbol in range(14 * 2**mu):
        kappa = 64
        length = 144 * kappa >> mu
        if symbol in (0, 7 * 2**mu):
            length += 16 * kappa
        unit = 2048 * kappa // 256 >> mu  # T_c per sample
        assert length % unit == 0 and start % unit == 0
        yield start // unit, length // unit
        start += length + (2048 * kappa >> mu)


# TS 38.331, 6.2.2, in the order of the message: each field alone, at its largest.
MIB = [
    ("systemFrameNumber", 6),
    ("subCarrierSpacingCommon", 1),
    ("ssb-SubcarrierOffset", 4),
    ("dmrs-TypeA-Position", 1),
    ("controlResourceSetZero", 4),
    ("searchSpaceZero", 4),
    ("cellBarred", 1),
    ("intraFreqReselection", 1),
    ("spare", 1),
]


def mibs():
    first = 1  # after the choice bit
    for name, width in MIB:
        yield name, 2**width - 1, [int(first <= i < first + width) for i in range(24)]
        first += width


# Cells that between them have each remainder of the PCI, each Lmax and half frame, and MIBs of
# each kind of bit: (24 MIB bits, SFN, half frame, SSB index, k_SSB's highest bit, PCI, Lmax).
def chains():
    bits = recursion([1, 0, 1, 1, 0, 0, 1], [3, 0], 200)
    plan = [
        (601, 0, 1, 4, 0, 341),
        (1, 1, 3, 4, 1, 682),
        (1007, 1, 6, 8, 0, 1023),
        (258, 0, 7, 8, 1, 5),
    ]
    plan += [(500, 1, 45, 64, 0, 86), (3, 0, 19, 64, 0, 617)]
    for n, (pci, half, index, lmax, k_msb, sfn) in enumerate(plan):
        mib = [0] + [sfn >> i & 1 for i in range(9, 3, -1)] + bits[17 * n : 17 * n + 17]
        yield tuple(mib), sfn, half, index, k_msb, pci, lmax


def packed(bits):
    """Bits as hexadecimal digits, the first bit most significant, zeros at the end."""
    bits = list(bits) + [0] * (-len(bits) % 4)
    return "".join(
        f"{int(''.join(map(str, bits[i : i + 4])), 2):x}" for i in range(0, len(bits), 4)
    )


def write():
    for n_id_2 in range(3):
        print("pss", n_id_2, packed(pss(n_id_2)))
    for pci in (0, 1, 2, 335, 336, 501, 671, 672, 1007):
        print("sss", pci, packed(sss(pci)))
    for pci, i in ((0, 0), (1, 3), (501, 4), (602, 7), (1007, 5)):
        print("dmrs", pci, i, packed(dmrs(pci, i)))
    for pci in range(4):
        free, pilots = elements(pci)
        for name, indices in (("dmrs_index", pilots), ("pbch_index", free)):
            used = set(indices)
            print(name, pci, packed([int(i in used) for i in range(960)]))
    for cell in chains():
        mib, sfn, half, index, k_msb, pci, lmax = cell
        print("pbch", pci, lmax, index, half, sfn, k_msb, packed(mib), *map(packed, pbch(cell)))
    for name, symbols in cases():
        print("case", name, *symbols)
    # TS 38.104 Table 5.4.3.1-1, in kHz.
    for n, m in ((1, 1), (1552, 5), (1779, 1), (2499, 3)):
        print("raster", 3 * n + (m - 3) // 2, 1200 * n + 50 * m)
    for n in (0, 356, 14756):
        print("raster", 7499 + n, 3_000_000 + 1440 * n)
    for n in (0, 132, 4383):
        print("raster", 22256 + n, 24_250_080 + 17_280 * n)
    for khz in (15, 30, 120, 240):
        all_of_them = list(prefixes(khz))
        for symbol in (
            0,
            1,
            len(all_of_them) // 2,
            len(all_of_them) // 2 + 1,
            len(all_of_them) - 1,
        ):
            print("prefix", khz, symbol, *all_of_them[symbol])
    for name, value, bits in mibs():
        print("mib", name, value, packed(bits))


def check(directory):
    import numpy as np

    known = np.load(f"{directory}/sequences.npz")
    assert all([1 - 2 * b for b in pss(n)] == list(known["pss"][n]) for n in range(3))
    for i, pci in enumerate(known["pcis"]):
        pci = int(pci)
        assert [1 - 2 * b for b in sss(pci)] == list(known["sss"][i])
        free, pilots = elements(pci)
        assert pilots == list(known["dmrs_index"][i]) and free == list(known["pbch_index"][i])
        for v in range(8):
            bits = 1 - 2 * np.array(dmrs(pci, v))
            assert np.allclose((bits[::2] + 1j * bits[1::2]) / 2**0.5, known["dmrs"][i][v])
    known = np.load(f"{directory}/pbch.npz")
    keys = ("payload", "payload_scrambled", "crc24c", "polar512", "ratematched864")
    for i in range(len(known["pci"])):
        one = {
            key: int(known[key][i]) for key in ("sfn", "hrf", "ssb_idx", "kssb_msb", "pci", "lmax")
        }
        stages = pbch((tuple(map(int, known["mib"][i])), *one.values()))
        for key, stage in zip(keys, stages):
            assert list(known[key][i]) == stage, (i, key)
    print("agrees with", directory, file=sys.stderr)


if __name__ == "__main__":
    check(sys.argv[2]) if sys.argv[1:2] == ["--check"] else write()
