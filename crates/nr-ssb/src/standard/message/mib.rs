//! The master information block (TS 38.331 §6.2.2).

use crate::error::Error;

/// Subcarrier spacing of SIB1, Msg2/4 and paging, `subCarrierSpacingCommon`. The meaning of the bit
/// depends on the frequency range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum SubcarrierSpacingCommon {
    /// 15 kHz in frequency range 1, 60 kHz in range 2.
    #[default]
    Scs15Or60,
    /// 30 kHz in frequency range 1, 120 kHz in range 2.
    Scs30Or120,
}

/// First DM-RS symbol of PDSCH and PUSCH, `dmrs-TypeA-Position`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum DmrsTypeAPosition {
    /// Symbol 2 of the slot.
    #[default]
    Pos2,
    /// Symbol 3 of the slot.
    Pos3,
}

/// Master information block (MIB), which a cell broadcasts in every SSB.
///
/// The MIB is transmitted as a 24-bit BCCH-BCH message in unaligned PER: one choice bit (0), then
/// the fields in this order.
///
/// ```
/// use nr_ssb::Mib;
/// let mib = Mib { sfn_msb: 0b10_1010, pdcch_config_sib1: 0x83, ..Mib::default() };
/// assert_eq!(Mib::from_bits(mib.bits())?, mib);
/// assert_eq!((mib.control_resource_set_zero(), mib.search_space_zero()), (8, 3));
/// # Ok::<(), nr_ssb::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Mib {
    /// `systemFrameNumber`: the six most significant bits of the SFN, 0 to 63.
    pub sfn_msb: u8,
    /// `subCarrierSpacingCommon`.
    pub subcarrier_spacing_common: SubcarrierSpacingCommon,
    /// `ssb-SubcarrierOffset`: the four least significant bits of k_SSB, 0 to 15.
    pub ssb_subcarrier_offset: u8,
    /// `dmrs-TypeA-Position`.
    pub dmrs_type_a_position: DmrsTypeAPosition,
    /// `pdcch-ConfigSIB1`: `controlResourceSetZero` and `searchSpaceZero`, four bits each.
    pub pdcch_config_sib1: u8,
    /// `cellBarred`: whether UEs must not camp on the cell. (Barred is transmitted as 0.)
    pub cell_barred: bool,
    /// `intraFreqReselection`: whether another cell of this frequency may be selected if this one
    /// is barred. (Allowed is transmitted as 0.)
    pub intra_freq_reselection: bool,
    /// The spare bit.
    pub spare: bool,
}

impl Mib {
    /// Returns `controlResourceSetZero`, 0 to 15: the row of TS 38.213 Tables 13-1 to 13-10.
    pub const fn control_resource_set_zero(&self) -> u8 {
        self.pdcch_config_sib1 >> 4
    }

    /// Returns `searchSpaceZero`, 0 to 15: the row of TS 38.213 Tables 13-11 to 13-15.
    pub const fn search_space_zero(&self) -> u8 {
        self.pdcch_config_sib1 & 0xF
    }

    /// Checks the ranges of all fields.
    ///
    /// # Errors
    /// [`Error::MibField`] for a field beyond its bits.
    pub fn check(&self) -> Result<(), Error> {
        let fields = [
            ("systemFrameNumber", self.sfn_msb, 63),
            ("ssb-SubcarrierOffset", self.ssb_subcarrier_offset, 15),
        ];
        for (field, value, max) in fields {
            if value > max {
                return Err(Error::MibField { field, value, max });
            }
        }
        Ok(())
    }

    /// Returns the 24 bits of the BCCH-BCH message, the first in bit 23. For a field beyond its
    /// range ([`check`](Self::check)) the low bits are used.
    pub fn bits(&self) -> u32 {
        u32::from(self.sfn_msb & 0x3F) << 17
            | u32::from(self.subcarrier_spacing_common == SubcarrierSpacingCommon::Scs30Or120) << 16
            | u32::from(self.ssb_subcarrier_offset & 0xF) << 12
            | u32::from(self.dmrs_type_a_position == DmrsTypeAPosition::Pos3) << 11
            | u32::from(self.pdcch_config_sib1) << 3
            | u32::from(!self.cell_barred) << 2
            | u32::from(!self.intra_freq_reselection) << 1
            | u32::from(self.spare)
    }

    /// Decodes a MIB; inverse of [`bits`](Self::bits).
    ///
    /// # Errors
    /// [`Error::MibTooLong`] beyond 24 bits; [`Error::MessageClassExtension`] if the choice bit is 1.
    pub fn from_bits(bits: u32) -> Result<Self, Error> {
        if bits >> 24 != 0 {
            return Err(Error::MibTooLong(bits));
        }
        if bits >> 23 == 1 {
            return Err(Error::MessageClassExtension);
        }
        let bit = |position: u32| bits >> position & 1 == 1;
        Ok(Self {
            sfn_msb: (bits >> 17 & 0x3F) as u8,
            subcarrier_spacing_common: if bit(16) {
                SubcarrierSpacingCommon::Scs30Or120
            } else {
                SubcarrierSpacingCommon::Scs15Or60
            },
            ssb_subcarrier_offset: (bits >> 12 & 0xF) as u8,
            dmrs_type_a_position: if bit(11) {
                DmrsTypeAPosition::Pos3
            } else {
                DmrsTypeAPosition::Pos2
            },
            pdcch_config_sib1: (bits >> 3 & 0xFF) as u8,
            cell_barred: !bit(2),
            intra_freq_reselection: !bit(1),
            spare: bit(0),
        })
    }

    /// Returns the 24 bits as text of `0` and `1`, in order of transmission.
    pub fn bit_string(&self) -> String {
        format!("{:024b}", self.bits())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_belongs_to_one_field() {
        for bits in (0..24).map(|i| 1u32 << i).take(23).chain([0, 0x7F_FFFF]) {
            assert_eq!(Mib::from_bits(bits).unwrap().bits(), bits);
        }
    }

    #[test]
    fn invalid_bits_and_fields_are_rejected() {
        assert_eq!(Mib::from_bits(1 << 23), Err(Error::MessageClassExtension));
        assert_eq!(Mib::from_bits(1 << 24), Err(Error::MibTooLong(1 << 24)));
        let mib = Mib {
            ssb_subcarrier_offset: 16,
            ..Mib::default()
        };
        assert!(matches!(
            mib.check(),
            Err(Error::MibField { value: 16, .. })
        ));
    }
}
