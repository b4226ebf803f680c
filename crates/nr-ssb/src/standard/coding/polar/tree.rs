//! Decoding tree: nodes at which the descent ends.

use super::code::INFORMATION_SET;
use super::encode::Codeword;
use super::leaf::Leaf;

/// Information channels as bits.
const INFORMATION: Codeword = {
    let mut channels = [0; 8];
    let mut k = 0;
    while k < INFORMATION_SET.len() {
        let channel = INFORMATION_SET[k] as usize;
        channels[channel / 64] |= 1 << (channel % 64);
        k += 1;
    }
    channels
};

/// Kind of node of the decoding tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Node {
    /// All channels are frozen: the all-zero word.
    Rate0,
    /// Code whose words are all compared.
    Leaf(Leaf),
    /// Node with two children.
    Split,
}

impl Node {
    /// Returns the node of `len` channels, a power of two, starting at its multiple `first`.
    pub fn at(first: usize, len: usize) -> Self {
        let words = &INFORMATION[first / 64..(first + len).div_ceil(64)];
        if len > 64 {
            let frozen = words.iter().all(|word| *word == 0);
            return if frozen { Self::Rate0 } else { Self::Split };
        }
        match words[0] >> (first % 64) & u64::MAX >> (64 - len) {
            0 => Self::Rate0,
            rows => Leaf::new(rows, len).map_or(Self::Split, Self::Leaf),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_of_the_decoding_tree_have_the_expected_types() {
        let leaf = |rows, len| Node::Leaf(Leaf::new(rows, len).unwrap());
        assert_eq!(Node::at(0, 512), Node::Split);
        assert_eq!(Node::at(0, 128), Node::Rate0);
        assert_eq!(Node::at(384, 32), leaf(1 << 31, 32));
        assert_eq!(
            Node::at(192, 64),
            leaf(1 << 55 | 1 << 61 | 1 << 62 | 1 << 63, 64)
        );
        assert_eq!(Node::at(504, 8), Node::Split);
        assert_eq!(Node::at(504, 4), leaf(0xF, 4));
    }
}
