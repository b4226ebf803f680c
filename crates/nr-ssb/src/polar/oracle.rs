//! List decoding by the book, one channel at a time and everything copied, to test against.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{INFORMATION_SET, K, ListDecoder, N, encode};

/// One path at a node: its metric, its place among the paths that entered, its bits.
type Path = (f64, usize, Vec<u8>);

/// Decode a node that begins at channel `first`, entered by paths with these metrics and LLRs.
fn visit(entered: &[(f64, Vec<f64>)], first: u16, list_size: usize) -> Vec<Path> {
    let len = entered[0].1.len();
    if len == 1 {
        let mut paths = Vec::new();
        for (parent, (metric, llr)) in entered.iter().enumerate() {
            paths.push((metric + (-llr[0]).max(0.0), parent, vec![0]));
            if INFORMATION_SET.contains(&first) {
                paths.push((metric + llr[0].max(0.0), parent, vec![1]));
            }
        }
        paths.sort_by(|a, b| a.0.total_cmp(&b.0));
        paths.truncate(list_size);
        return paths;
    }
    let half = len / 2;
    let f = |(metric, llr): &(f64, Vec<f64>)| {
        let child = (0..half).map(|i| {
            let (a, b) = (llr[i], llr[i + half]);
            a.signum() * b.signum() * a.abs().min(b.abs())
        });
        (*metric, child.collect())
    };
    let left = visit(&entered.iter().map(f).collect::<Vec<_>>(), first, list_size);
    let g = |(metric, parent, bits): &Path| {
        let llr = &entered[*parent].1;
        let child = (0..half).map(|i| llr[i + half] + (1.0 - 2.0 * f64::from(bits[i])) * llr[i]);
        (*metric, child.collect())
    };
    let middle = first + half as u16;
    let right = visit(&left.iter().map(g).collect::<Vec<_>>(), middle, list_size);
    let join = |(metric, parent, right): Path| {
        let (_, grandparent, left) = &left[parent];
        let sum = left.iter().zip(&right).map(|(l, r)| l ^ r);
        (
            metric,
            *grandparent,
            sum.chain(right.iter().copied()).collect(),
        )
    };
    right.into_iter().map(join).collect()
}

#[test]
fn survivors_are_those_of_the_book() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for list_size in [1, 2, 3, 8, 32] {
        let mut decoder = ListDecoder::new(list_size).unwrap();
        for _ in 0..20 {
            let sent = encode(rng.random::<u64>() >> (64 - K));
            let llr: [f32; N] = std::array::from_fn(|n| {
                let noise: f32 = StandardNormal.sample(&mut rng);
                1.0 - 2.0 * (sent[n / 64] >> (n % 64) & 1) as f32 + 2.0 * noise
            });
            let root = (0.0, llr.iter().map(|&x| f64::from(x)).collect());
            let expected = visit(&[root], 0, list_size);
            let got: Vec<_> = decoder.decode(&llr).map(encode).collect();
            assert_eq!(got.len(), expected.len());
            for (codeword, (_, _, bits)) in got.iter().zip(&expected) {
                let bits = bits.iter().enumerate();
                let equal = bits
                    .clone()
                    .all(|(n, &bit)| codeword[n / 64] >> (n % 64) & 1 == u64::from(bit));
                assert!(equal, "list of {list_size}");
            }
        }
    }
}
