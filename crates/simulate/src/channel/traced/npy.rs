//! Reader of NumPy's npy format (NumPy enhancement proposal 1).

/// First bytes of a file.
const MAGIC: &[u8] = b"\x93NUMPY";

/// Array of an npy file.
#[derive(Debug, PartialEq, Eq)]
pub struct Npy<'a> {
    /// Type of the elements with its byte order, such as `<f8`; empty for a structured type.
    pub kind: &'a str,
    /// Whether the first index changes fastest.
    pub is_by_column: bool,
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// Bytes of the elements.
    pub elements: &'a [u8],
}

impl<'a> Npy<'a> {
    /// Reads the header of a file. The error states which part of the header is invalid.
    pub fn new(file: &'a [u8]) -> Result<Self, &'static str> {
        let (header, elements) = split(file).ok_or("the header of the npy format is missing")?;
        let kind = value(header, "descr").ok_or("`descr` is missing in the header")?;
        let kind = quoted(kind).unwrap_or_default();
        let order = value(header, "fortran_order");
        let is_by_column = match order {
            Some(order) if order.starts_with("True") => true,
            Some(order) if order.starts_with("False") => false,
            _ => return Err("`fortran_order` is missing in the header"),
        };
        let shape = value(header, "shape").and_then(lengths);
        let shape = shape.ok_or("`shape` is missing in the header, or not a tuple of lengths")?;
        Ok(Self {
            kind,
            is_by_column,
            shape,
            elements,
        })
    }

    /// Returns the elements of `WIDTH` bytes; an error unless their number is that of the shape.
    pub fn elements<const WIDTH: usize>(&self) -> Result<&'a [[u8; WIDTH]], String> {
        let expected = self
            .shape
            .iter()
            .try_fold(1_usize, |all, &length| all.checked_mul(length));
        let (elements, rest) = self.elements.as_chunks();
        if !rest.is_empty() || Some(elements.len()) != expected {
            let (shape, found) = (&self.shape, self.elements.len());
            return Err(format!(
                "{found} bytes do not fill the shape {shape:?} with elements of {WIDTH} bytes"
            ));
        }
        Ok(elements)
    }
}

/// Returns header and elements of a file.
fn split(file: &[u8]) -> Option<(&str, &[u8])> {
    let (&[major, _minor], rest) = file.strip_prefix(MAGIC)?.split_first_chunk()?;
    let (length, rest) = if major == 1 {
        let (&length, rest) = rest.split_first_chunk()?;
        (usize::from(u16::from_le_bytes(length)), rest)
    } else {
        let (&length, rest) = rest.split_first_chunk()?;
        (usize::try_from(u32::from_le_bytes(length)).ok()?, rest)
    };
    let (header, elements) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(header).ok()?, elements))
}

/// Returns the header from the value of `key` on.
fn value<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = header.split_once(&format!("'{key}':"))?;
    Some(rest.trim_start())
}

fn quoted(text: &str) -> Option<&str> {
    Some(text.strip_prefix('\'')?.split_once('\'')?.0)
}

fn lengths(text: &str) -> Option<Vec<usize>> {
    let (tuple, _) = text.strip_prefix('(')?.split_once(')')?;
    let lengths = tuple.split(',').map(str::trim);
    let lengths = lengths.filter(|length| !length.is_empty());
    lengths.map(|length| length.parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(version: u8, header: &str, elements: &[u8]) -> Vec<u8> {
        let mut file = [MAGIC, &[version, 0]].concat();
        let length = header.len() as u32;
        match version {
            1 => file.extend((length as u16).to_le_bytes()),
            _ => file.extend(length.to_le_bytes()),
        }
        file.extend(header.as_bytes());
        file.extend(elements);
        file
    }

    #[test]
    fn headers_of_all_versions_are_read() {
        let header = "{'descr': '<i2', 'fortran_order': True, 'shape': (2, 1), }   \n";
        for version in 1..=3 {
            let file = file(version, header, &[1, 0, 2, 1]);
            let npy = Npy::new(&file).unwrap();
            assert_eq!((npy.kind, npy.is_by_column), ("<i2", true));
            assert_eq!(npy.shape, [2, 1]);
            let values = npy
                .elements()
                .unwrap()
                .iter()
                .copied()
                .map(i16::from_le_bytes);
            assert_eq!(values.collect::<Vec<_>>(), [1, 258]);
        }
        let scalar = file(
            1,
            "{'descr': '|u1', 'fortran_order': False, 'shape': ()}",
            &[7],
        );
        let scalar = Npy::new(&scalar).unwrap();
        assert_eq!(scalar.shape, [0; 0]);
        assert_eq!(scalar.elements::<1>(), Ok(&[[7]][..]));
        let structured = "{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (1,)}";
        assert_eq!(Npy::new(&file(1, structured, &[0; 8])).unwrap().kind, "");
    }

    #[test]
    fn invalid_files_are_rejected() {
        let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }";
        let whole = file(1, header, &[0; 12]);
        assert!(Npy::new(&whole).unwrap().elements::<4>().is_ok());
        for length in 0..whole.len() {
            let part = Npy::new(&whole[..length]);
            let complete = length >= whole.len() - 12;
            assert_eq!(part.is_ok(), complete, "{length}");
            assert!(!part.is_ok_and(|it| it.elements::<4>().is_ok()), "{length}");
        }
        for (old, new) in [
            ("descr", "type"),
            ("False", "None"),
            ("(3,)", "(-3,)"),
            ("(3,)", "(3"),
            ("(3,)", "3"),
        ] {
            let file = file(1, &header.replace(old, new), &[0; 12]);
            assert!(Npy::new(&file).is_err(), "{new}");
        }
        let huge = file(
            1,
            &header.replace("(3,)", &format!("({}, 2)", usize::MAX)),
            &[0; 12],
        );
        assert!(Npy::new(&huge).unwrap().elements::<4>().is_err());
    }
}
