//! Successive cancellation list decoding.
//!
//! I. Tal, A. Vardy, "List decoding of polar codes", IEEE Trans. Inf. Theory 61 (2015), with log-likelihood
//! ratios and path metrics as in A. Balatsoukas-Stimming et al., IEEE Trans. Signal Process. 63 (2015), and
//! whole constituent codes decoded at once as in S. A. Hashemi et al., "Fast and flexible successive-
//! cancellation list decoders for polar codes", IEEE Trans. Signal Process. 65 (2017).
//!
//! All paths visit a node together. A path that splits copies nothing but its indices into the
//! buffers of each tree level: what a node wrote is never changed until all paths write it anew.

use super::encode::Codeword;
use super::tree::{MAX_LEAF, Node};
use super::{N, message_of};
use crate::Error;

/// Largest list size.
const MAX_LIST: usize = 32;
/// log2 N: levels above the single channels.
const DEPTH: usize = N.ilog2() as usize;

/// For each path, which buffer of a level is its own.
type Slots = [u8; MAX_LIST];

const IDENTITY: Slots = {
    let mut slots = [0; MAX_LIST];
    let mut path = 0;
    while path < MAX_LIST {
        slots[path] = path as u8;
        path += 1;
    }
    slots
};

/// One buffer of `len` values per path.
#[derive(Debug, Clone)]
struct Buffers {
    values: Vec<f32>,
    len: usize,
    slots: Slots,
}

impl Buffers {
    fn new(paths: usize, len: usize) -> Self {
        Self {
            values: vec![0.0; paths * len],
            len,
            slots: IDENTITY,
        }
    }

    fn of(&self, path: usize) -> &[f32] {
        &self.values[usize::from(self.slots[path]) * self.len..][..self.len]
    }

    /// Buffers to write for the paths in order; all `paths` of them must be written.
    fn rewrite(&mut self) -> std::slice::ChunksExactMut<'_, f32> {
        self.slots = IDENTITY;
        self.values.chunks_exact_mut(self.len)
    }
}

/// What the paths know at one level of the tree, in nodes of 2^level channels.
#[derive(Debug, Clone)]
struct Level {
    /// Log-likelihood ratios of the node being visited.
    alpha: Buffers,
    /// Decided bits of the left and of the right child of a parent, as ±1.
    beta: [Buffers; 2],
}

/// The side of its parent that a node is on.
#[derive(Debug, Clone, Copy)]
enum Side {
    Left,
    Right,
}

/// How a surviving path came about.
#[derive(Debug, Clone, Copy, Default)]
struct Branch {
    metric: f32,
    parent: u8,
    /// Which of the two continuations of the parent.
    second: bool,
}

/// Surviving paths after a split.
type Survivors = [Branch; MAX_LIST];

/// Per path, the bits of a node by rising reliability.
type Ranking = [[u8; MAX_LEAF]; MAX_LIST];

/// Decoder of the PBCH's polar code that keeps up to 32 paths; owns its buffers.
///
/// List size 1 is successive cancellation.
#[derive(Debug, Clone)]
pub struct ListDecoder {
    list_size: usize,
    levels: [Level; DEPTH + 1],
    /// Path metrics: the sum of |LLR| over all decisions against the LLR's sign.
    metrics: [f32; MAX_LIST],
    paths: usize,
}

impl ListDecoder {
    /// # Errors
    /// [`Error::ListSize`] unless `list_size` is 1 to 32.
    pub fn new(list_size: usize) -> Result<Self, Error> {
        if (1..=MAX_LIST).contains(&list_size) {
            Ok(Self::with_buffers(list_size))
        } else {
            Err(Error::ListSize(list_size))
        }
    }

    /// A decoder of a list size known to the compiler, which refuses it unless it is 1 to 32.
    pub fn with_list_of<const L: usize>() -> Self {
        const { assert!(L >= 1 && L <= MAX_LIST) };
        Self::with_buffers(L)
    }

    fn with_buffers(list_size: usize) -> Self {
        let levels = std::array::from_fn(|level| {
            let buffers = Buffers::new(list_size, 1 << level);
            Level {
                alpha: buffers.clone(),
                beta: [buffers.clone(), buffers],
            }
        });
        Self {
            list_size,
            levels,
            metrics: [0.0; MAX_LIST],
            paths: 1,
        }
    }

    /// How many paths are kept.
    pub const fn list_size(&self) -> usize {
        self.list_size
    }

    /// Decode the log-likelihood ratios (positive for bit 0, any scale) of N coded bits: the messages
    /// of the surviving paths, each of 56 bits with the first in bit 55, most likely first.
    pub fn decode(&mut self, llr: &[f32; N]) -> Candidates<'_> {
        self.paths = 1;
        self.metrics[0] = 0.0;
        if let Some(root) = self.levels[DEPTH].alpha.rewrite().next() {
            root.copy_from_slice(llr);
        }
        self.visit(DEPTH, 0, Side::Left);

        let mut order = IDENTITY;
        order[..self.paths].sort_unstable_by(|&a, &b| {
            self.metrics[usize::from(a)].total_cmp(&self.metrics[usize::from(b)])
        });
        Candidates {
            decoder: self,
            order,
            next: 0,
        }
    }

    /// Decode the node of 2^`level` channels from `first` on: from `alpha` of this level to `beta` on
    /// this side.
    fn visit(&mut self, level: usize, first: usize, side: Side) {
        let len = 1 << level;
        match Node::at(first, len) {
            Node::Rate0 => self.rate_0(level, side),
            Node::Repetition => self.repetition(level, side),
            Node::SingleParity => self.single_parity(level, side),
            Node::Rate1 => self.rate_1(level, side),
            Node::Split => {
                self.descend_left(level);
                self.visit(level - 1, first, Side::Left);
                self.descend_right(level);
                self.visit(level - 1, first + len / 2, Side::Right);
                self.combine(level, side);
            }
        }
    }

    /// LLRs of the left child: f(a, b) = sign(a)·sign(b)·min(|a|, |b|).
    fn descend_left(&mut self, level: usize) {
        let (children, parents) = self.levels.split_at_mut(level);
        let (child, parent) = (&mut children[level - 1].alpha, &parents[0].alpha);
        for (path, out) in child.rewrite().take(self.paths).enumerate() {
            let (a, b) = parent.of(path).split_at(out.len());
            for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
                let sign = (a.to_bits() ^ b.to_bits()) & (1 << 31);
                let (a, b) = (a.abs(), b.abs());
                let smaller = if a < b { a } else { b };
                *out = f32::from_bits(smaller.to_bits() | sign);
            }
        }
    }

    /// LLRs of the right child, its left sibling being decided: g(a, b, ±1) = b ± a.
    fn descend_right(&mut self, level: usize) {
        let (children, parents) = self.levels.split_at_mut(level);
        let parent = &parents[0].alpha;
        let Level {
            alpha,
            beta: [left, _],
        } = &mut children[level - 1];
        for (path, out) in alpha.rewrite().take(self.paths).enumerate() {
            let (a, b) = parent.of(path).split_at(out.len());
            for (((out, &a), &b), &s) in out.iter_mut().zip(a).zip(b).zip(left.of(path)) {
                *out = b + s * a;
            }
        }
    }

    /// Bits of a node from those of its children: (left ⊕ right, right).
    fn combine(&mut self, level: usize, side: Side) {
        let (children, parents) = self.levels.split_at_mut(level);
        let [left, right] = &children[level - 1].beta;
        for (path, out) in parents[0].beta[side as usize]
            .rewrite()
            .take(self.paths)
            .enumerate()
        {
            let (sum, same) = out.split_at_mut(left.len);
            let right = right.of(path);
            for ((out, &l), &r) in sum.iter_mut().zip(left.of(path)).zip(right) {
                *out = l * r;
            }
            same.copy_from_slice(right);
        }
    }

    fn rate_0(&mut self, level: usize, side: Side) {
        let Level { alpha, beta } = &mut self.levels[level];
        let metrics = self.metrics.iter_mut().take(self.paths);
        for ((path, metric), out) in metrics.enumerate().zip(beta[side as usize].rewrite()) {
            *metric += against(alpha.of(path))[0];
            out.fill(1.0);
        }
    }

    fn repetition(&mut self, level: usize, side: Side) {
        let alpha = &self.levels[level].alpha;
        let mut costs = [[0.0; 2]; MAX_LIST];
        for (path, cost) in costs.iter_mut().enumerate().take(self.paths) {
            *cost = against(alpha.of(path));
        }
        let survivors = self.split(level, &costs);
        let outs = self.levels[level].beta[side as usize].rewrite();
        for (out, survivor) in outs.zip(&survivors[..self.paths]) {
            out.fill(if survivor.second { -1.0 } else { 1.0 });
        }
    }

    /// Hard decisions, and every path split at its least reliable bits; beyond L − 1 of them no
    /// change could survive.
    fn rate_1(&mut self, level: usize, side: Side) {
        let ranking = self.rank(level);
        let mut flips = [0u16; MAX_LIST];
        for turn in 0..(1 << level).min(self.list_size - 1) {
            let alpha = &self.levels[level].alpha;
            let mut costs = [[0.0; 2]; MAX_LIST];
            for (path, cost) in costs.iter_mut().enumerate().take(self.paths) {
                let bit = ranking[usize::from(alpha.slots[path])][turn];
                cost[1] = alpha.of(path)[usize::from(bit)].abs();
            }
            let survivors = self.split(level, &costs);
            self.inherit(&mut flips, &survivors);
            let alpha = &self.levels[level].alpha;
            for (path, survivor) in survivors.iter().enumerate().take(self.paths) {
                let bit = ranking[usize::from(alpha.slots[path])][turn];
                flips[path] ^= u16::from(survivor.second) << bit;
            }
        }
        self.decide(level, side, &flips);
    }

    /// Hard decisions, the least reliable bit making the parity even; then every path split at its
    /// next least reliable bits, each change taking the least reliable bit along.
    fn single_parity(&mut self, level: usize, side: Side) {
        let ranking = self.rank(level);
        let mut flips = [0u16; MAX_LIST];
        let alpha = &self.levels[level].alpha;
        for path in 0..self.paths {
            let values = alpha.of(path);
            let least = ranking[usize::from(alpha.slots[path])][0];
            let odd = values
                .iter()
                .fold(0, |parity, x| parity ^ x.to_bits() >> 31);
            flips[path] = (odd as u16) << least;
            self.metrics[path] += odd as f32 * values[usize::from(least)].abs();
        }
        for turn in 1..(1 << level).min(self.list_size) {
            let alpha = &self.levels[level].alpha;
            let mut costs = [[0.0; 2]; MAX_LIST];
            for (path, cost) in costs.iter_mut().enumerate().take(self.paths) {
                let ranked = &ranking[usize::from(alpha.slots[path])];
                let magnitude = |rank: usize| alpha.of(path)[usize::from(ranked[rank])].abs();
                let flipped = flips[path] >> ranked[0] & 1 == 1;
                cost[1] = magnitude(turn) + if flipped { -magnitude(0) } else { magnitude(0) };
            }
            let survivors = self.split(level, &costs);
            self.inherit(&mut flips, &survivors);
            let alpha = &self.levels[level].alpha;
            for (path, survivor) in survivors.iter().enumerate().take(self.paths) {
                let ranked = &ranking[usize::from(alpha.slots[path])];
                if survivor.second {
                    flips[path] ^= 1 << ranked[turn] | 1 << ranked[0];
                }
            }
        }
        self.decide(level, side, &flips);
    }

    /// The bits of each LLR buffer of this level by rising |LLR|.
    fn rank(&self, level: usize) -> Ranking {
        let mut ranking = [[0; MAX_LEAF]; MAX_LIST];
        let Buffers { values, len, .. } = &self.levels[level].alpha;
        for (order, values) in ranking
            .iter_mut()
            .zip(values.chunks_exact(*len))
            .take(self.paths)
        {
            for (rank, bit) in order.iter_mut().zip(0..) {
                *rank = bit;
            }
            order[..*len].sort_unstable_by(|&a, &b| {
                values[usize::from(a)]
                    .abs()
                    .total_cmp(&values[usize::from(b)].abs())
            });
        }
        ranking
    }

    /// Write the signs of this level's LLRs, those in `flips` reversed, as decided bits.
    fn decide(&mut self, level: usize, side: Side, flips: &[u16; MAX_LIST]) {
        let Level { alpha, beta } = &mut self.levels[level];
        for (path, out) in beta[side as usize].rewrite().take(self.paths).enumerate() {
            for (bit, (out, &x)) in out.iter_mut().zip(alpha.of(path)).enumerate() {
                let flip = f32::from(flips[path] >> bit & 1);
                *out = 1f32.copysign(x) * (1.0 - 2.0 * flip);
            }
        }
    }

    /// Let every path go on in two ways at the given costs in a node of this level, keep the best,
    /// and hand each survivor its parent's buffers.
    fn split(&mut self, level: usize, costs: &[[f32; 2]; MAX_LIST]) -> Survivors {
        let mut branches = [Branch::default(); 2 * MAX_LIST];
        let count = 2 * self.paths;
        for (path, cost) in costs.iter().enumerate().take(self.paths) {
            for (second, cost) in [false, true].into_iter().zip(cost) {
                branches[2 * path + usize::from(second)] = Branch {
                    metric: self.metrics[path] + cost,
                    parent: path as u8,
                    second,
                };
            }
        }
        let kept = count.min(self.list_size);
        if kept < count {
            branches[..count].select_nth_unstable_by(kept, |a, b| a.metric.total_cmp(&b.metric));
        }
        let mut survivors = [Branch::default(); MAX_LIST];
        survivors[..kept].copy_from_slice(&branches[..kept]);
        self.paths = kept;
        for (metric, survivor) in self.metrics.iter_mut().zip(&survivors[..kept]) {
            *metric = survivor.metric;
        }
        // Below this node nothing is read before it is written anew, and neither are right siblings.
        for Level {
            alpha,
            beta: [left, _],
        } in &mut self.levels[level..]
        {
            for slots in [&mut alpha.slots, &mut left.slots] {
                let before = *slots;
                for (slot, survivor) in slots.iter_mut().zip(&survivors[..kept]) {
                    *slot = before[usize::from(survivor.parent)];
                }
            }
        }
        survivors
    }

    /// Hand each survivor its parent's flips.
    fn inherit(&self, flips: &mut [u16; MAX_LIST], survivors: &Survivors) {
        let before = *flips;
        for (flips, survivor) in flips.iter_mut().zip(survivors).take(self.paths) {
            *flips = before[usize::from(survivor.parent)];
        }
    }

    /// The message of a path, once the root is decided.
    fn message(&self, path: usize) -> u64 {
        let beta = self.levels[DEPTH].beta[Side::Left as usize].of(path);
        let mut codeword = Codeword::default();
        for (word, signs) in codeword.iter_mut().zip(beta.chunks_exact(64)) {
            *word = signs
                .iter()
                .rev()
                .fold(0, |word, s| word << 1 | u64::from(s.to_bits() >> 31));
        }
        message_of(&codeword)
    }
}

/// Messages found by [`ListDecoder::decode`], most likely first.
#[derive(Debug)]
pub struct Candidates<'a> {
    decoder: &'a ListDecoder,
    order: Slots,
    next: usize,
}

impl Iterator for Candidates<'_> {
    type Item = u64;

    fn next(&mut self) -> Option<u64> {
        let path = *self.order[..self.decoder.paths].get(self.next)?;
        self.next += 1;
        Some(self.decoder.message(usize::from(path)))
    }
}

/// The cost of deciding all bits 0 and of deciding all bits 1: the sum of |LLR| of the contrary.
fn against(alpha: &[f32]) -> [f32; 2] {
    // Independent partial sums, so that the additions need not wait for one another.
    const LANES: usize = 8;
    let mut zeros = [0.0; LANES];
    let mut ones = [0.0; LANES];
    for chunk in alpha.chunks(LANES) {
        for ((zero, one), &x) in zeros.iter_mut().zip(&mut ones).zip(chunk) {
            *zero += if x < 0.0 { -x } else { 0.0 };
            *one += if x > 0.0 { x } else { 0.0 };
        }
    }
    [zeros.iter().sum(), ones.iter().sum()]
}
