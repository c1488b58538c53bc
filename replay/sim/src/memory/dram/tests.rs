use super::channel::Channel;
use super::mapping::{BurstAddress, Mapper};
use super::*;

const ALL: [DramPreset; 4] = [
    DramPreset::Lpddr4,
    DramPreset::Lpddr5,
    DramPreset::Ddr4,
    DramPreset::Gddr6,
];

fn config(preset: DramPreset) -> DramConfig {
    DramConfig {
        preset,
        channels: 1,
        ..DramConfig::default()
    }
}

/// Reads whole bursts that all arrive at the same time.
fn at_once(config: &DramConfig, bursts: impl Iterator<Item = u32>) -> DramResult {
    let mut dram = Dram::new(config, config.preset.device().burst_bytes);
    bursts.for_each(|burst| dram.read(burst, None));
    dram.result()
}

#[test]
fn a_lone_read_takes_activate_read_and_burst() {
    for preset in ALL {
        let device = preset.device();
        let mut dram = Dram::new(&config(preset), device.burst_bytes);
        dram.read(0, Some(0));
        let clocks = device.rcd + device.cl + device.burst;
        let found = dram.result();
        let expected = f64::from(clocks * device.clock_ps) * 1e-3;
        assert!(
            (found.latency_mean_ns - expected).abs() < 1e-9,
            "{preset:?}"
        );
        assert_eq!((found.reads, found.row_empty, found.activates), (1, 1, 1));
    }
}

#[test]
fn a_row_that_is_open_needs_no_activate_and_another_one_a_precharge() {
    for preset in ALL {
        let device = preset.device();
        let row = device.row_bytes / device.burst_bytes;
        let mut dram = Dram::new(&config(preset), device.burst_bytes);
        // Far apart, but all before the first refresh.
        let gap = 1_200;
        let next_row_of_bank = row * device.banks();
        for (turn, burst) in (0..).zip([0, 1, next_row_of_bank]) {
            let clock = u64::from(device.clock_ps) * gap * turn;
            // A GPU of 1000 MHz has cycles of 1000 ps.
            dram.read(burst, Some(clock * 600 / 1_000_000));
        }
        let found = dram.result();
        let [hit, empty, conflict] = [0, device.rcd, device.rp + device.rcd];
        let clocks = hit + empty + conflict + 3 * (device.cl + device.burst);
        let mean = f64::from(clocks * device.clock_ps) * 1e-3 / 3.0;
        assert!(
            (found.latency_mean_ns - mean).abs() < 1e-9,
            "{preset:?}: {} {mean}",
            found.latency_mean_ns
        );
        let kinds = (found.row_hits, found.row_empty, found.row_conflicts);
        assert_eq!(kinds, (1, 1, 1), "{preset:?}");
    }
}

#[test]
fn a_stream_opens_each_row_once_and_fills_the_bus_between_refreshes() {
    for preset in ALL {
        let device = preset.device();
        let per_row = device.row_bytes / device.burst_bytes;
        let rows = 512;
        // Refreshes close rows too, so the exact count is checked without them.
        let stream = (0..rows * per_row).map(u64::from);
        let mapper = Mapper::new(Mapping::default(), 1, &device);
        let mut channel = Channel::new(
            Device {
                refi: u32::MAX,
                ..device
            },
            32,
            PagePolicy::Open,
        );
        stream
            .clone()
            .for_each(|burst| channel.arrive(mapper.place(burst), false, None));
        channel.drain();
        assert_eq!(channel.counts.activates, u64::from(rows), "{preset:?}");
        // The reads of a row lie in one group, ccd_l apart. While the queue holds bursts of the
        // next row, reads of two groups alternate.
        let reads = f64::from(rows * per_row);
        let [fastest, slowest] =
            [device.ccd_s, device.ccd_l].map(|gap| f64::from(gap.max(device.burst)));
        let gap = channel.counts.end as f64 / reads;
        assert!(
            (fastest..1.02 * slowest).contains(&gap),
            "{preset:?}: {gap}"
        );
        // Refreshes take no more than their share of the time. (They also let the reads of two rows alternate.)
        let found = at_once(&config(preset), 0..rows * per_row);
        let free = 1.0 - f64::from(device.rfc) / f64::from(device.refi);
        let time = found.time_us * 1e6 / f64::from(device.clock_ps);
        let most = 1.02 * channel.counts.end as f64 / free;
        assert!(
            (reads * fastest..most).contains(&time),
            "{preset:?}: {time}"
        );
    }
}

#[test]
fn strides_of_a_row_conflict_in_one_bank_and_take_the_row_cycle() {
    for preset in ALL {
        let device = preset.device();
        let stride = device.row_bytes / device.burst_bytes * device.banks();
        // A queue of one serves in order of arrival.
        let config = DramConfig {
            queue: 1,
            ..config(preset)
        };
        let count = 300;
        let found = at_once(&config, (0..count).map(|i| i * stride));
        assert_eq!(found.row_hits, 0, "{preset:?}");
        // A refresh may close a row before it is read.
        let again = found.activates - u64::from(count);
        assert!(again <= found.refreshes, "{preset:?}: {again}");
        let row_cycle = (device.ras + device.rp).max(device.rcd + device.rtp + device.rp);
        let clocks = found.time_us * 1e6 / f64::from(device.clock_ps);
        let free = 1.0 - f64::from(device.rfc) / f64::from(device.refi);
        let expected = f64::from(count * row_cycle) / free;
        assert!(
            (clocks / expected - 1.0).abs() < 0.04,
            "{preset:?}: {clocks} {expected}"
        );
        // With the bank XORed with the row, neighbouring rows lie in different banks.
        let spread = DramConfig {
            mapping: Mapping::RowBankXorColumnChannel,
            queue: 32,
            ..config
        };
        let quicker = at_once(&spread, (0..count).map(|i| i * stride));
        assert!(quicker.time_us < 0.6 * found.time_us, "{preset:?}");
    }
}

#[test]
fn four_activates_fit_a_window() {
    for preset in ALL {
        let device = preset.device();
        // Each read in another bank, one read per row.
        let config = DramConfig {
            mapping: Mapping::RowColumnBankChannel,
            ..config(preset)
        };
        let mut channel = Channel::new(device, 32, PagePolicy::Open);
        let mapper = Mapper::new(config.mapping, 1, &device);
        let banks = u64::from(device.banks());
        (0..banks).for_each(|burst| channel.arrive(mapper.place(burst), false, None));
        channel.drain();
        let last = channel.counts.end - u64::from(device.rcd + device.cl + device.burst);
        let least = (banks - 1) / 4 * u64::from(device.faw.max(4 * device.rrd_s));
        assert!(last >= least, "{preset:?}: {last} {least}");
        assert!(
            last <= least + 4 * u64::from(device.rrd_l),
            "{preset:?}: {last} {least}"
        );
    }
}

#[test]
fn isolated_reads_have_no_row_hits_with_closed_pages() {
    for preset in ALL {
        let closed = DramConfig {
            page_policy: PagePolicy::Closed,
            ..config(preset)
        };
        let run = |config: &DramConfig| {
            let mut dram = Dram::new(config, config.preset.device().burst_bytes);
            (0..100).for_each(|i| dram.read(i % 8, Some(u64::from(i) * 100)));
            dram.result()
        };
        let (open, closed) = (run(&config(preset)), run(&closed));
        // Reads that wait for a refresh together share a row.
        assert!(
            closed.row_hits <= 3 * closed.refreshes,
            "{preset:?}: {closed:?}"
        );
        assert_eq!(closed.row_conflicts, 0, "{preset:?}: {closed:?}");
        assert!(open.row_hits > 85, "{preset:?}");
    }
}

#[test]
fn every_request_is_answered_once_in_no_less_than_the_least_time() {
    let mut random = 1_u64;
    let mut next = || {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        random >> 33
    };
    for preset in ALL {
        for mapping in [
            Mapping::RowBankColumnChannel,
            Mapping::RowColumnBankChannel,
            Mapping::RowBankXorColumnChannel,
        ] {
            for queue in [1, 8, 64] {
                let config = DramConfig {
                    preset,
                    mapping,
                    queue,
                    channels: 4,
                    ..DramConfig::default()
                };
                let mut dram = Dram::new(&config, 16);
                let mut cycle = 0;
                for _ in 0..3000 {
                    cycle += next() % 40;
                    dram.read((next() % 200_000) as u32, Some(cycle));
                }
                let found = dram.result();
                assert_eq!((found.requests, found.reads), (3000, 3000));
                let kinds = found.row_hits + found.row_empty + found.row_conflicts;
                assert_eq!(kinds, found.reads);
                assert!(found.activates >= found.row_empty + found.row_conflicts);
                let device = preset.device();
                let least = f64::from((device.cl + device.burst) * device.clock_ps) * 1e-3;
                assert!(
                    found.latency_p50_ns >= least && found.latency_p99_ns >= found.latency_p50_ns
                );
                assert!(found.bandwidth_gb_per_s <= found.peak_gb_per_s);
            }
        }
    }
}

#[test]
fn every_burst_has_a_distinct_place() {
    for preset in ALL {
        let device = preset.device();
        for mapping in [
            Mapping::RowBankColumnChannel,
            Mapping::RowColumnBankChannel,
            Mapping::RowBankXorColumnChannel,
        ] {
            let mapper = Mapper::new(mapping, 4, &device);
            let per_row = device.row_bytes / device.burst_bytes;
            let mut rows = std::collections::HashMap::new();
            let bursts = 4 * device.banks() * per_row * 4;
            for burst in 0..u64::from(bursts) {
                let BurstAddress {
                    channel, bank, row, ..
                } = mapper.place(burst);
                *rows.entry((channel, bank, row)).or_insert(0) += 1;
            }
            assert!(
                rows.values().all(|n| *n == per_row),
                "{preset:?} {mapping:?}"
            );
            assert_eq!(rows.len() as u32, 4 * device.banks() * 4);
        }
    }
}

/// Reads or writes whole bursts that all arrive at the same time.
fn mixed(config: &DramConfig, bursts: impl Iterator<Item = (u32, bool)>) -> DramResult {
    let bytes = u64::from(config.preset.device().burst_bytes);
    let mut dram = Dram::new(config, bytes as u32);
    bursts.for_each(|(burst, write)| dram.request(u64::from(burst) * bytes, bytes, write, None));
    dram.result()
}

#[test]
fn writes_saturate_the_bus_like_reads() {
    for preset in ALL {
        let [reads, writes] =
            [false, true].map(|write| mixed(&config(preset), (0..20_000).map(|b| (b, write))));
        assert_eq!((writes.writes, writes.reads), (20_000, 0));
        assert_eq!((reads.writes, reads.reads), (0, 20_000));
        assert_eq!(reads.write_bytes + writes.read_bytes, 0);
        let ratio = writes.bandwidth_gb_per_s / reads.bandwidth_gb_per_s;
        assert!((ratio - 1.0).abs() < 0.02, "{preset:?}: {ratio}");
    }
}

/// A read that follows a write of an open row waits for the write's data and the bus turnaround.
#[test]
fn a_read_after_a_write_waits_for_its_data_and_the_bus_turnaround() {
    for preset in ALL {
        let device = preset.device();
        let mapper = Mapper::new(Mapping::default(), 1, &device);
        let mut channel = Channel::new(device, 32, PagePolicy::Open);
        channel.arrive(mapper.place(0), true, Some(0));
        // The write's data transfer has begun when the read arrives.
        let arrival = u64::from(device.rcd + 1);
        channel.arrive(mapper.place(1), false, Some(arrival));
        channel.drain();
        let write_end = u64::from(device.rcd + device.cwl + device.burst);
        let read = write_end + u64::from(device.wtr_l);
        let end = read + u64::from(device.cl + device.burst);
        assert_eq!(channel.counts.end, end, "{preset:?}");
        assert_eq!((channel.counts.row_hits, channel.counts.writes), (1, 1));
    }
}

/// A written row must be restored before it is closed.
#[test]
fn another_row_waits_for_write_recovery() {
    for preset in ALL {
        let device = preset.device();
        let row = device.row_bytes / device.burst_bytes * device.banks();
        let [read_first, write_first] = [false, true]
            .map(|write| mixed(&config(preset), [(0, write), (row, write)].into_iter()));
        let clocks = |result: &DramResult| {
            (result.time_us * 1e6 / f64::from(device.clock_ps)).round() as u32
        };
        let after_read = device.ras.max(device.rcd + device.rtp);
        let after_write = device
            .ras
            .max(device.rcd + device.cwl + device.burst + device.wr);
        let again = device.rp + device.rcd + device.burst;
        assert_eq!(
            clocks(&read_first),
            after_read + again + device.cl,
            "{preset:?}"
        );
        assert_eq!(
            clocks(&write_first),
            after_write + again + device.cwl,
            "{preset:?}"
        );
    }
}

#[test]
fn every_request_of_a_random_mixture_is_answered_once() {
    for preset in ALL {
        for queue in [1, 8, 32] {
            let config = DramConfig {
                queue,
                ..config(preset)
            };
            let bursts = (0..5000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 12, i % 3 == 0));
            let found = mixed(&config, bursts);
            assert_eq!((found.writes, found.reads), (1667, 3333));
            assert_eq!(found.row_hits + found.row_empty + found.row_conflicts, 3333);
            assert!(found.write_row_hits <= 1667 && found.activates > 1000);
        }
    }
}

/// Lines of twice the size of a burst, and of half its size.
#[test]
fn requests_are_lines_and_reads_and_writes_are_bursts() {
    for preset in ALL {
        let burst = preset.device().burst_bytes;
        for (line_bytes, bursts) in [(2 * burst, 2), (burst / 2, 1)] {
            let mut dram = Dram::new(&config(preset), line_bytes);
            (0..3).for_each(|line| dram.read(8 * line, None));
            dram.request(1 << 20, line_bytes.into(), true, None);
            let result = dram.result();
            assert_eq!((result.line_bytes, result.burst_bytes), (line_bytes, burst));
            assert_eq!(result.requests, 4);
            assert_eq!((result.reads, result.writes), (3 * bursts, bursts));
            let shown = result.to_string();
            let lines = format!(
                "4 lines of {line_bytes} B requested; {} bursts of {burst} B read",
                3 * bursts
            );
            assert!(shown.contains(&lines), "{shown}");
        }
    }
}

/// A closed loop issues the commands of the open one, and answers each read in the cycle of its last data.
#[test]
fn a_closed_loop_gives_the_result_of_an_open_one_and_no_answer_is_late() {
    for preset in ALL {
        let config = config(preset);
        let line_bytes = 64;
        let mut open = Dram::new(&config, line_bytes);
        let channels = Box::new(Dram::new(&config, line_bytes));
        let mut closed = ClosedLoop::new(channels, &config, line_bytes);
        let mut answered = Vec::new();
        let (mut cycle, mut polled, mut latencies) = (0, 0, Vec::new());
        for number in 0..3000_u64 {
            let line = (number as u32).wrapping_mul(2_654_435_761) >> (12 + number % 3);
            cycle += number % 40;
            while polled + closed.poll_cycles() < cycle {
                polled += closed.poll_cycles();
                closed.advance(polled, &mut answered);
                assert!(answered.iter().all(|(_, at)| *at >= polled), "{preset:?}");
                latencies.append(&mut answered);
            }
            open.read(line, Some(cycle));
            closed.read(cycle, line, number);
        }
        closed.advance(u64::from(u32::MAX), &mut latencies);
        let mut numbers: Vec<u64> = latencies.iter().map(|(number, _)| *number).collect();
        numbers.sort_unstable();
        assert!(numbers.into_iter().eq(0..3000), "{preset:?}");
        assert!(!closed.is_busy());
        let (open, closed) = (open.result(), closed.result());
        assert_eq!(
            (open.row_hits, open.row_conflicts),
            (closed.row_hits, closed.row_conflicts)
        );
        assert_eq!(
            (open.reads, open.latency_p99_ns),
            (closed.reads, closed.latency_p99_ns)
        );
        assert_eq!(
            (open.latency_mean_ns, open.time_us),
            (closed.latency_mean_ns, closed.time_us)
        );
    }
}
