//! PBCH decoder on arbitrary log-likelihood ratios.
//!
//! Byte 0: burst set size, list size, whether periods are combined. Bytes 1 and 2: the cell. The
//! remaining bytes are f32 values, repeated as often as needed: 864 ratios per period.

use nr_ssb::pbch::{Decoder, Period};
use nr_ssb::{Error, Lmax, Pci};

pub fn run(data: &[u8]) {
    let [settings, low, high, rest @ ..] = data else {
        return;
    };
    let lmax = [Lmax::L4, Lmax::L8, Lmax::L64][usize::from(settings & 3) % 3];
    let list_size = 1 + usize::from(settings >> 2 & 7);
    let Ok(pci) = Pci::new((u16::from(*low) | u16::from(*high) << 8) % 1008) else {
        unreachable!("below 1008");
    };
    let words = rest.as_chunks::<4>().0;
    if words.is_empty() {
        return;
    }
    let mut values = words.iter().cycle().map(|bytes| f32::from_le_bytes(*bytes));
    let periods = if settings >> 5 & 1 == 1 { 3 } else { 1 };
    let llrs: Vec<[f32; 864]> = (0..periods)
        .map(|_| std::array::from_fn(|_| values.next().unwrap_or(0.0)))
        .collect();
    let Ok(mut decoder) = Decoder::new(list_size) else {
        unreachable!("1 to 8");
    };
    let heard: Vec<Period> = llrs
        .iter()
        .zip(0..)
        .map(|(llr, n)| Period {
            llr,
            half_frames: n << (settings >> 6),
        })
        .collect();
    match decoder.combine(&heard, pci, low & 7, lmax) {
        Ok(Some(decoded)) => {
            decoded.payload.check().expect("fields within their bits");
            assert!(decoded.symbols().iter().all(|x| x.is_finite()));
        }
        Ok(None) => {}
        Err(Error::NonFiniteLlr(place)) => {
            assert!(llrs.iter().any(|llr| !llr[place].is_finite()));
        }
        Err(other) => panic!("{other}"),
    }
}
