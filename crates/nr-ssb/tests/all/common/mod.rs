//! Reader of the reference vectors, which are in a directory next to the project.

use std::fs::File;
use std::io::Read;
use std::path::PathBuf;

use nr_ssb::{BchPayload, Complex32, Lmax, Mib, Pci};

/// Returns the directory of reference data: `ACCESS_AV_DATA`, or `../shared/data`.
pub fn data_dir() -> PathBuf {
    std::env::var_os("ACCESS_AV_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    )
}

/// One `.npz` file of vectors.
pub struct Vectors(PathBuf);

impl Vectors {
    /// Opens a file by its name.
    pub fn open(name: &str) -> Self {
        let path = data_dir().join("vectors").join(name);
        assert!(path.is_file(), "no reference vectors at {}", path.display());
        Self(path)
    }

    /// Returns the bytes of one array: an `.npz` file is a zip archive of `.npy` files.
    fn npy(&self, key: &str) -> Vec<u8> {
        let mut archive = zip::ZipArchive::new(File::open(&self.0).unwrap()).unwrap();
        let mut bytes = Vec::new();
        let mut entry = archive.by_name(&format!("{key}.npy")).expect(key);
        entry.read_to_end(&mut bytes).unwrap();
        bytes
    }

    /// Returns an array, flattened in C order.
    pub fn array<T: Element<W>, const W: usize>(&self, key: &str) -> Vec<T> {
        let npy = self.npy(key);
        let (header, bytes) = header_and_bytes(&npy);
        let (kind, order) = (T::KIND, "'fortran_order': False");
        assert!(
            header.contains(&format!("'descr': '{kind}'")),
            "{key}: {header}"
        );
        assert!(header.contains(order), "{key}: {header}");
        let (elements, rest) = bytes.as_chunks();
        assert!(rest.is_empty(), "{key}: {header}");
        elements.iter().copied().map(T::of).collect()
    }

    /// Returns a zero-dimensional array of text (NumPy's UTF-32).
    pub fn text(&self, key: &str) -> String {
        let npy = self.npy(key);
        let (_, bytes) = header_and_bytes(&npy);
        let codes = bytes.as_chunks().0.iter().copied().map(u32::from_le_bytes);
        codes
            .take_while(|&code| code != 0)
            .filter_map(char::from_u32)
            .collect()
    }
}

/// Splits an npy file of version 1 (NumPy enhancement proposal 1).
fn header_and_bytes(npy: &[u8]) -> (&str, &[u8]) {
    let (length, rest) = npy
        .strip_prefix(b"\x93NUMPY\x01\x00")
        .and_then(<[u8]>::split_first_chunk)
        .expect("a file of version 1");
    let (header, bytes) = rest.split_at(u16::from_le_bytes(*length).into());
    (std::str::from_utf8(header).unwrap(), bytes)
}

/// Element of `W` bytes of an array.
pub trait Element<const W: usize> {
    /// NumPy's name of the type.
    const KIND: &'static str;

    fn of(bytes: [u8; W]) -> Self;
}

macro_rules! elements {
    ($($type:ident $width:literal $kind:literal)*) => {$(
        impl Element<$width> for $type {
            const KIND: &'static str = $kind;

            fn of(bytes: [u8; $width]) -> Self {
                Self::from_le_bytes(bytes)
            }
        }
    )*};
}
elements!(i8 1 "|i1" u8 1 "|u1" i16 2 "<i2" i32 4 "<i4" i64 8 "<i8" f64 8 "<f8");

impl Element<8> for Complex32 {
    const KIND: &'static str = "<c8";

    fn of([a, b, c, d, e, f, g, h]: [u8; 8]) -> Self {
        Self::new(
            f32::from_le_bytes([a, b, c, d]),
            f32::from_le_bytes([e, f, g, h]),
        )
    }
}

/// One cell's parameters in `pbch.npz` or `pbch_extra.npz`.
pub struct Cell {
    pub pci: Pci,
    pub lmax: Lmax,
    pub payload: BchPayload,
}

/// Returns all cells of `pbch.npz` or `pbch_extra.npz`.
pub fn cells(vectors: &Vectors) -> Vec<Cell> {
    let column = |key| vectors.array::<i32, _>(key);
    let (pci, lmax, index) = (column("pci"), column("lmax"), column("ssb_idx"));
    let (hrf, sfn, kssb_msb) = (column("hrf"), column("sfn"), column("kssb_msb"));
    let mib = vectors.array::<u8, _>("mib");
    (0..pci.len())
        .map(|i| {
            let mib = Mib::from_bits(pack(&mib[24 * i..24 * (i + 1)])).unwrap();
            let payload = BchPayload::new(mib, sfn[i] as u16, hrf[i] == 1, index[i] as u8).unwrap();
            assert_eq!(payload.mib, mib, "the MIB's SFN bits are those of the SFN");
            Cell {
                pci: Pci::new(pci[i] as u16).unwrap(),
                lmax: match lmax[i] {
                    4 => Lmax::L4,
                    8 => Lmax::L8,
                    _ => Lmax::L64,
                },
                payload: BchPayload {
                    k_ssb_msb: kssb_msb[i] == 1,
                    ..payload
                },
            }
        })
        .collect()
}

/// Packs up to 32 bits; the first one becomes the most significant.
pub fn pack(bits: &[u8]) -> u32 {
    bits.iter()
        .fold(0, |packed, &bit| packed << 1 | u32::from(bit))
}
