//! Common Data Representation (OMG DDS-XTypes, classic CDR) of ROS 2 messages. Every number is
//! aligned to a multiple of its size, relative to the end of the four-byte header.

/// Header of little-endian classic CDR.
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// Encoder of a message.
#[derive(Debug, Default)]
pub(super) struct Encoder {
    bytes: Vec<u8>,
}

macro_rules! numbers {
    ($($name:ident: $type:ty),*) => {
        $(pub fn $name(&mut self, value: $type) -> &mut Self {
            self.align(size_of::<$type>());
            self.bytes.extend(value.to_le_bytes());
            self
        })*
    };
}

impl Encoder {
    /// Starts a new message in the same buffer.
    pub fn start(&mut self) -> &mut Self {
        self.bytes.clear();
        self.bytes.extend(LITTLE_ENDIAN);
        self
    }

    numbers!(u8: u8, u16: u16, u32: u32, i32: i32, f64: f64);

    pub fn string(&mut self, text: &str) -> &mut Self {
        self.u32(text.len() as u32 + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
        self
    }

    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn align(&mut self, size: usize) {
        let body = self.bytes.len() - LITTLE_ENDIAN.len();
        let aligned = body.next_multiple_of(size) + LITTLE_ENDIAN.len();
        self.bytes.resize(aligned, 0);
    }
}

/// Decoder of a message; every method returns `None` if the message is too short.
#[derive(Debug)]
pub(super) struct Decoder<'a> {
    body: &'a [u8],
    position: usize,
    little_endian: bool,
}

impl<'a> Decoder<'a> {
    pub fn new(message: &'a [u8]) -> Option<Self> {
        let (header, body) = message.split_first_chunk::<4>()?;
        let little_endian = match header {
            [0, 0, ..] => false,
            [0, 1, ..] => true,
            _ => return None,
        };
        Some(Self {
            body,
            position: 0,
            little_endian,
        })
    }

    pub fn u8(&mut self) -> Option<u8> {
        self.take().map(u8::from_le_bytes)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.number(u16::from_le_bytes, u16::from_be_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.number(u32::from_le_bytes, u32::from_be_bytes)
    }

    pub fn i32(&mut self) -> Option<i32> {
        self.u32().map(u32::cast_signed)
    }

    pub fn f64(&mut self) -> Option<f64> {
        self.number(f64::from_le_bytes, f64::from_be_bytes)
    }

    /// Reads an array of numbers.
    pub fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Some(values)
    }

    pub fn skip_string(&mut self) -> Option<()> {
        let length = self.u32()? as usize;
        self.position = self
            .position
            .checked_add(length)
            .filter(|end| *end <= self.body.len())?;
        Some(())
    }

    fn number<const N: usize, T>(
        &mut self,
        from_little: fn([u8; N]) -> T,
        from_big: fn([u8; N]) -> T,
    ) -> Option<T> {
        let from = if self.little_endian {
            from_little
        } else {
            from_big
        };
        self.take().map(from)
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let start = self.position.next_multiple_of(N);
        let bytes = self.body.get(start..)?.first_chunk::<N>()?;
        self.position = start + N;
        Some(*bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_to_their_size() {
        let mut encoder = Encoder::default();
        encoder
            .start()
            .u8(7)
            .u16(0x0102)
            .string("ab")
            .f64(1.0)
            .i32(-1);
        let body = [
            &[7, 0, 2, 1][..],
            &[3, 0, 0, 0, b'a', b'b', 0],
            &[0; 5],
            &1f64.to_le_bytes(),
            &[255; 4],
        ]
        .concat();
        assert_eq!(encoder.bytes(), [&LITTLE_ENDIAN[..], &body].concat());
    }

    #[test]
    fn messages_round_trip_and_truncated_ones_are_rejected() {
        let mut encoder = Encoder::default();
        encoder.start().i32(-5).u32(6).string("frame").f64(-2.5);
        let whole = encoder.bytes();
        let read = |message| {
            let mut decoder = Decoder::new(message)?;
            let numbers = (decoder.i32()?, decoder.u32()?);
            decoder.skip_string()?;
            Some((numbers, decoder.f64()?))
        };
        assert_eq!(read(whole), Some(((-5, 6), -2.5)));
        for length in 0..whole.len() {
            assert_eq!(read(&whole[..length]), None);
        }
    }
}
