//! Lines out of a stream of bytes, of bounded length.

/// Bytes of the longest line that is taken.
pub const LONGEST: usize = 1 << 16;

/// Cuts what comes in into lines.
#[derive(Debug, Default)]
pub struct Lines {
    begun: Vec<u8>,
    /// Whether the line being read is too long, and is left out.
    overlong: bool,
}

impl Lines {
    /// Hands each line that `bytes` completes to `take`, `None` for one that was too long.
    pub fn push(&mut self, bytes: &[u8], mut take: impl FnMut(Option<&[u8]>)) {
        let mut rest = bytes;
        while let Some(end) = rest.iter().position(|byte| *byte == b'\n') {
            let (line, after) = rest.split_at(end);
            self.extend(line);
            take((!self.overlong).then_some(&self.begun));
            self.begun.clear();
            self.overlong = false;
            rest = after.get(1..).unwrap_or_default();
        }
        self.extend(rest);
    }

    /// Hands over a last line that no newline ends, and begins anew.
    pub fn finish(&mut self, mut take: impl FnMut(Option<&[u8]>)) {
        if !self.begun.is_empty() || self.overlong {
            self.push(b"\n", &mut take);
        }
    }

    fn extend(&mut self, bytes: &[u8]) {
        if self.begun.len() + bytes.len() > LONGEST {
            self.overlong = true;
            self.begun.clear();
        } else if !self.overlong {
            self.begun.extend_from_slice(bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_the_same_however_they_come() {
        let long = vec![b'x'; LONGEST + 1];
        let text = [b"one\n\ntwo\n".as_slice(), &long, b"\nthree"].concat();
        for piece in [1, 2, 7, 1000, text.len()] {
            let (mut lines, mut found) = (Lines::default(), Vec::new());
            for bytes in text.chunks(piece) {
                lines.push(bytes, |line| found.push(line.map(<[u8]>::to_vec)));
            }
            lines.finish(|line| found.push(line.map(<[u8]>::to_vec)));
            let expected = [Some("one"), Some(""), Some("two"), None, Some("three")];
            let expected = expected.map(|it| it.map(|it| it.as_bytes().to_vec()));
            assert_eq!(found, expected, "{piece}");
        }
    }
}
