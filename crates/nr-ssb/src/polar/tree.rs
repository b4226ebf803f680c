//! The decoding tree: which of its nodes need no descent.

use super::{INFORMATION_SET, N};

/// Longest single-parity or rate-1 node that is decoded at once; every one of this code fits.
pub const MAX_LEAF: usize = 16;

/// The code that a node of the decoding tree is by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Node {
    /// All channels frozen: the all-zero word.
    Rate0,
    /// Only the last channel carries information: all bits equal.
    Repetition,
    /// Only the first channel is frozen: an even number of ones.
    SingleParity,
    /// No channel frozen: any word.
    Rate1,
    /// None of these.
    Split,
}

/// Information channels before each channel.
const BEFORE: [usize; N + 1] = {
    let mut before = [0; N + 1];
    let mut found = 0;
    let mut channel = 0;
    while channel < N {
        before[channel] = found;
        if found < INFORMATION_SET.len() && INFORMATION_SET[found] as usize == channel {
            found += 1;
        }
        channel += 1;
    }
    before[N] = found;
    before
};

impl Node {
    /// The node over `len` channels from `first` on.
    pub const fn at(first: usize, len: usize) -> Self {
        let information = BEFORE[first + len] - BEFORE[first];
        let last = BEFORE[first + len] - BEFORE[first + len - 1];
        let after_first = BEFORE[first + len] - BEFORE[first + 1];
        if information == 0 {
            Self::Rate0
        } else if information == 1 && last == 1 {
            Self::Repetition
        } else if len <= MAX_LEAF && information == len {
            Self::Rate1
        } else if len <= MAX_LEAF && information == len - 1 && after_first == len - 1 {
            Self::SingleParity
        } else {
            Self::Split
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_what_their_channels_say() {
        assert_eq!(Node::at(0, 128), Node::Rate0);
        assert_eq!(Node::at(384, 32), Node::Repetition);
        assert_eq!(Node::at(496, 16), Node::SingleParity);
        assert_eq!(Node::at(444, 4), Node::Rate1);
        assert_eq!(Node::at(440, 4), Node::Split);
        assert_eq!(Node::at(0, 512), Node::Split);
    }
}
