//! Reference list decoder for tests: one channel at a time, with copies of all values.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::checks::Check;
use super::code::{INFORMATION_SET, N};
use super::encode::{Codeword, encode};
use super::list::ListDecoder;
use super::tree::Node;
use crate::standard::message::crc::crc24c;

/// Path at the start of a node: metric, LLRs, decided bits u.
type Entered = (f64, Vec<f64>, Codeword);
/// Path at the end of a node: metric, index of its path at the start, bits, u.
type Path = (f64, usize, Vec<u8>, Codeword);

/// Decodes the node that begins at channel `first`. The list is pruned at the ends of the leaves;
/// `in_leaf` states whether this node is part of a leaf.
fn visit(entered: &[Entered], first: usize, list_size: usize, in_leaf: bool) -> Vec<Path> {
    let len = entered[0].1.len();
    let is_leaf = !in_leaf && matches!(Node::at(first, len), Node::Leaf(_));
    let inside = in_leaf || is_leaf;
    let mut paths = if len == 1 {
        channel(entered, first)
    } else {
        let half = len / 2;
        let f = |(metric, llr, u): &Entered| {
            let child = (0..half).map(|i| {
                let (a, b) = (llr[i], llr[i + half]);
                a.signum() * b.signum() * a.abs().min(b.abs())
            });
            (*metric, child.collect(), *u)
        };
        let left: Vec<_> = entered.iter().map(f).collect();
        let left = visit(&left, first, list_size, inside);
        let g = |(metric, parent, bits, u): &Path| {
            let llr = &entered[*parent].1;
            let child =
                (0..half).map(|i| llr[i + half] + (1.0 - 2.0 * f64::from(bits[i])) * llr[i]);
            (*metric, child.collect(), *u)
        };
        let right: Vec<_> = left.iter().map(g).collect();
        let right = visit(&right, first + half, list_size, inside);
        let join = |(metric, parent, right, u): Path| {
            let (_, grandparent, left, _) = &left[parent];
            let sum = left.iter().zip(&right).map(|(l, r)| l ^ r);
            let bits = sum.chain(right.iter().copied()).collect();
            (metric, *grandparent, bits, u)
        };
        right.into_iter().map(join).collect()
    };
    if is_leaf {
        paths.sort_by(|a, b| a.0.total_cmp(&b.0));
        paths.truncate(list_size);
    }
    paths
}

/// Returns both continuations at an information channel, or the only one at a frozen channel.
fn channel(entered: &[Entered], channel: usize) -> Vec<Path> {
    let mut paths = Vec::new();
    for (parent, (metric, llr, u)) in entered.iter().enumerate() {
        for bit in [0, 1] {
            let mut u = *u;
            u[channel / 64] |= u64::from(bit) << (channel % 64);
            let allowed = match Check::inside(channel, 1) {
                Some(check) => check.holds(&u, 0, 0),
                None => bit == 0 || INFORMATION_SET.contains(&(channel as u16)),
            };
            if allowed {
                let against = if bit == 0 { -llr[0] } else { llr[0] };
                paths.push((metric + against.max(0.0), parent, vec![bit], u));
            }
        }
    }
    paths
}

#[test]
fn survivors_equal_those_of_the_textbook_decoder() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for list_size in [1, 2, 3, 8, 32] {
        let mut decoder = ListDecoder::new(list_size).unwrap();
        for _ in 0..20 {
            let payload = rng.random();
            let sent = encode(u64::from(payload) << 24 | u64::from(crc24c(payload)));
            let llr: [f32; N] = std::array::from_fn(|n| {
                let noise: f32 = StandardNormal.sample(&mut rng);
                1.0 - 2.0 * (sent[n / 64] >> (n % 64) & 1) as f32 + 2.0 * noise
            });
            let root = llr.iter().map(|&x| f64::from(x)).collect();
            let expected = visit(&[(0.0, root, Codeword::default())], 0, list_size, false);
            let got: Vec<_> = decoder.decode(&llr).map(encode).collect();
            assert_eq!(got.len(), expected.len());
            for (codeword, (_, _, bits, _)) in got.iter().zip(&expected) {
                let bits = bits.iter().enumerate();
                let equal = bits
                    .clone()
                    .all(|(n, &bit)| codeword[n / 64] >> (n % 64) & 1 == u64::from(bit));
                assert!(equal, "list of {list_size}");
            }
        }
    }
}
