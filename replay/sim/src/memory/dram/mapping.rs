//! Address mapping: bursts to channel, bank, row and column.

use super::presets::Device;

crate::choices! { #[non_exhaustive] Mapping = "Assignment of a burst number's bits, highest to lowest.", default RowBankColumnChannel:
    RowBankColumnChannel = "row-bank-column-channel", "Row, bank, column, channel: consecutive bursts alternate between channels, and a row holds adjacent bursts.";
    RowColumnBankChannel = "row-column-bank-channel", "Row, column, bank, channel: consecutive bursts lie in different banks.";
    RowBankXorColumnChannel = "row-bank-xor-column-channel", "As the default, with the bank XORed with the lowest row bits, so that rows a power of two apart lie in different banks.";
}

/// Location of a burst.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BurstAddress {
    /// Channel.
    pub channel: u32,
    /// Bank group.
    pub group: u32,
    /// Bank of the channel, counted over all groups.
    pub bank: u32,
    /// Row.
    pub row: u64,
}

/// Number of bits of each part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mapper {
    mapping: Mapping,
    channel_bits: u32,
    bank_bits: u32,
    column_bits: u32,
    groups: u32,
}

impl Mapper {
    /// The mapping for this number of channels of a device.
    pub const fn new(mapping: Mapping, channels: u32, device: &Device) -> Self {
        Self {
            mapping,
            channel_bits: channels.trailing_zeros(),
            bank_bits: device.banks().trailing_zeros(),
            column_bits: (device.row_bytes / device.burst_bytes).trailing_zeros(),
            groups: device.groups,
        }
    }

    /// The location of a burst.
    pub const fn place(&self, burst: u64) -> BurstAddress {
        let mut rest = burst;
        let channel = take(&mut rest, self.channel_bits);
        let bank = match self.mapping {
            Mapping::RowColumnBankChannel => {
                let bank = take(&mut rest, self.bank_bits);
                take(&mut rest, self.column_bits);
                bank
            }
            Mapping::RowBankColumnChannel | Mapping::RowBankXorColumnChannel => {
                take(&mut rest, self.column_bits);
                take(&mut rest, self.bank_bits)
            }
        };
        let row = rest;
        let bank = match self.mapping {
            Mapping::RowBankXorColumnChannel => bank ^ take(&mut rest, self.bank_bits),
            _ => bank,
        };
        BurstAddress {
            channel,
            // Consecutive banks lie in different groups, because reads of different groups can follow most closely.
            group: bank % self.groups,
            bank,
            row,
        }
    }
}

/// Removes and returns the lowest bits.
const fn take(rest: &mut u64, bits: u32) -> u32 {
    let low = *rest & ((1 << bits) - 1);
    *rest >>= bits;
    low as u32
}
