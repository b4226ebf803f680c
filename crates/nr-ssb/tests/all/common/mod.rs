//! Reader of the reference vectors, which are in a directory next to the project.

use std::fs::File;
use std::io::Read;
use std::path::PathBuf;

use npyz::{Deserialize, NpyFile};
use nr_ssb::{BchPayload, Lmax, Mib, Pci};

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
    pub fn array<T: Deserialize>(&self, key: &str) -> Vec<T> {
        let npy = self.npy(key);
        let array = NpyFile::new(&*npy).unwrap();
        assert_eq!(array.order(), npyz::Order::C, "{key}");
        array.into_vec().unwrap()
    }

    /// Returns a zero-dimensional array of text (NumPy's UTF-32).
    pub fn text(&self, key: &str) -> String {
        let npy = self.npy(key);
        let mut bytes = Vec::new();
        NpyFile::new(&*npy)
            .unwrap()
            .into_inner()
            .read_to_end(&mut bytes)
            .unwrap();
        let codes = bytes.as_chunks().0.iter().copied().map(u32::from_le_bytes);
        codes
            .take_while(|&code| code != 0)
            .filter_map(char::from_u32)
            .collect()
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
    let column = |key| vectors.array::<i32>(key);
    let (pci, lmax, index) = (column("pci"), column("lmax"), column("ssb_idx"));
    let (hrf, sfn, kssb_msb) = (column("hrf"), column("sfn"), column("kssb_msb"));
    let mib = vectors.array::<u8>("mib");
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
