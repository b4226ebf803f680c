//! Definition of the polar code: lengths, information channels, interleaver.

/// Length of the mother code, N.
pub const N: usize = 512;
/// Message bits, K: payload and CRC.
pub const K: usize = 56;

/// Q_I in ascending order: the K most reliable of the N bit channels (TS 38.212 Table 5.3.1.2-1; E
/// ≥ N, so that there is no puncturing or shortening). The other channels are frozen to 0.
pub(super) const INFORMATION_SET: [u16; K] = [
    247, 253, 254, 255, 367, 375, 379, 381, 382, 383, 415, 431, 439, 441, 443, 444, 445, 446, 447,
    463, 469, 470, 471, 473, 474, 475, 476, 477, 478, 479, 483, 485, 486, 487, 489, 490, 491, 492,
    493, 494, 495, 497, 498, 499, 500, 501, 502, 503, 504, 505, 506, 507, 508, 509, 510, 511,
];

/// Π: message bit `INTERLEAVER[k]` is mapped to the k-th information channel (TS 38.212 §5.3.1.1,
/// I_IL = 1).
pub(super) const INTERLEAVER: [u8; K] = [
    0, 2, 3, 5, 7, 10, 11, 12, 14, 15, 18, 19, 21, 24, 26, 30, 31, 32, 1, 4, 6, 8, 13, 16, 20, 22,
    25, 27, 33, 9, 17, 23, 28, 34, 29, 35, 36, 37, 38, 39, 40, 41, 42, 43, 44, 45, 46, 47, 48, 49,
    50, 51, 52, 53, 54, 55,
];
