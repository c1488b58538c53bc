//! From addresses to channel, bank, row and column.

use super::presets::Device;
use serde::{Deserialize, Serialize};

/// Bits of a burst's number, from the highest to the lowest.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Mapping {
    /// Row, bank, column, channel: bursts that follow each other take turns at the channels, and a row holds what lies
    /// together.
    #[default]
    RowBankColumnChannel,
    /// Row, column, bank, channel: bursts that follow each other lie in different banks.
    RowColumnBankChannel,
    /// As the default, the bank combined with the row's lowest bits (XOR), so that rows that lie apart by a power of two
    /// differ in bank.
    RowBankXorColumnChannel,
}

/// Where a burst lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Channel.
    pub channel: u32,
    /// Bank group.
    pub group: u32,
    /// Bank of the channel, over all groups.
    pub bank: u32,
    /// Row.
    pub row: u64,
}

/// Bits of each part.
#[derive(Clone, Copy, Debug)]
pub struct Mapper {
    mapping: Mapping,
    channel_bits: u32,
    bank_bits: u32,
    column_bits: u32,
    groups: u32,
}

impl Mapper {
    /// For so many channels of a device.
    pub const fn new(mapping: Mapping, channels: u32, device: &Device) -> Self {
        Self {
            mapping,
            channel_bits: channels.trailing_zeros(),
            bank_bits: device.banks().trailing_zeros(),
            column_bits: (device.row_bytes / device.burst_bytes).trailing_zeros(),
            groups: device.groups,
        }
    }

    /// Where the burst of a number lies.
    pub const fn place(&self, burst: u64) -> Place {
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
        Place {
            channel,
            // Banks that follow each other lie in different groups, as reads of different groups are closest.
            group: bank % self.groups,
            bank,
            row,
        }
    }
}

/// The lowest bits, which are then gone.
const fn take(rest: &mut u64, bits: u32) -> u32 {
    let low = *rest & ((1 << bits) - 1);
    *rest >>= bits;
    low as u32
}
