//! The physical cell identity.

use crate::error::Error;

/// Physical cell identity N_ID^cell = 3·N_ID1 + N_ID2, from 0 to 1007 (TS 38.211 §7.4.2.1).
///
/// ```
/// let pci = nr_ssb::Pci::new(601)?;
/// assert_eq!((pci.n_id_1(), pci.n_id_2()), (200, 1));
/// assert!(nr_ssb::Pci::new(1008).is_err());
/// # Ok::<(), nr_ssb::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pci(u16);

impl Pci {
    /// Number of physical cell identities.
    pub const COUNT: u16 = 1008;

    /// Returns the identity with number `value`.
    ///
    /// # Errors
    /// [`Error::Pci`] beyond 1007.
    pub fn new(value: u16) -> Result<Self, Error> {
        if value < Self::COUNT {
            Ok(Self(value))
        } else {
            Err(Error::Pci(value))
        }
    }

    /// Returns every identity, in order.
    pub fn all() -> impl ExactSizeIterator<Item = Self> {
        (0..Self::COUNT).map(Self)
    }

    /// Returns the number, 0 to 1007.
    pub const fn get(self) -> u16 {
        self.0
    }

    /// Returns N_ID1, 0 to 335, which selects the SSS.
    pub const fn n_id_1(self) -> u16 {
        self.0 / 3
    }

    /// Returns N_ID2, 0 to 2, which selects the PSS.
    pub const fn n_id_2(self) -> u8 {
        (self.0 % 3) as u8
    }
}

impl std::fmt::Display for Pci {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}
