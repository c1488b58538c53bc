//! `dram open|closed read=R@C,...`: reads of bursts of one bank, each of row R at cycle C.

use super::Settings;
use replay::memory::dram::{Dram, DramConfig, Mapping, PagePolicy};

pub fn output(settings: &Settings) -> Vec<String> {
    let page_policy = match settings.subject.as_str() {
        "closed" => PagePolicy::Closed,
        _ => PagePolicy::Open,
    };
    let config = DramConfig {
        channels: 1,
        page_policy,
        mapping: Mapping::RowBankColumnChannel,
        ..DramConfig::default()
    };
    let device = config.preset.device();
    let row_bytes = u64::from(device.row_bytes) * u64::from(device.banks());
    let burst_bytes = u64::from(device.burst_bytes);
    let mut dram = Dram::new(&config, device.burst_bytes);
    for (column, read) in settings.list("read").into_iter().enumerate() {
        let (row, cycle) = read
            .split_once('@')
            .unwrap_or_else(|| panic!("{read}: expected ROW@CYCLE"));
        let (row, cycle): (u64, u64) = (row.parse().unwrap(), cycle.parse().unwrap());
        dram.request(
            row * row_bytes + burst_bytes * column as u64,
            burst_bytes,
            false,
            Some(cycle),
        );
    }
    let result = dram.result();
    vec![
        format!("rows opened: {}", result.activates),
        format!("reads of an open row: {}", result.row_hits),
        format!(
            "reads that opened a row of a closed bank: {}",
            result.row_empty
        ),
        format!(
            "reads that closed another row first: {}",
            result.row_conflicts
        ),
    ]
}
