//! Lines of a byte stream with a maximum length.

/// Maximum length of a line in bytes.
pub const LONGEST: usize = 1 << 16;

/// Splitter of a byte stream into lines.
#[derive(Debug, Default)]
pub struct Lines {
    begun: Vec<u8>,
    /// Whether the current line is too long and will be omitted.
    overlong: bool,
}

impl Lines {
    /// Calls `take` for each line that `bytes` completes, with `None` for a line that was too long.
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

    /// Calls `take` for a last line without a newline, and resets the splitter.
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
    fn lines_do_not_depend_on_the_split_of_the_bytes() {
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
