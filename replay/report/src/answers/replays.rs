//! Sentences about replays: the traffic of one, machines, samples of a path, and schemes of reuse over time.

use crate::html::count;
use crate::lists::unique;
use sim::config::RunConfig;
use sim::figure::Figure;
use sim::preset::Preset;
use sim::size::format_bytes;
use studies::sampling::of::Of;

/// Megabytes (10^6 bytes), or kilobytes if there are few.
fn size(mb: f64) -> String {
    match mb < 0.1 {
        true => format!("{:.1} kB", 1e3 * mb),
        false => format!("{mb:.2} MB"),
    }
}

/// Traffic of a replay, in MB per frame.
pub struct Traffic {
    /// Scene and order.
    pub of: String,
    /// Textures' traffic between the last cache and memory.
    pub texture_mb: f64,
    /// The same of an infinite cache.
    pub bound_mb: f64,
    /// Sum of the largest known errors, percent.
    pub error_pct: f64,
    /// Traffic of all clients of memory, if it was counted.
    pub frame_mb: Option<f64>,
}

/// The traffic of one replay.
pub fn replayed(traffic: &Traffic) -> Vec<String> {
    let Traffic {
        of,
        texture_mb,
        bound_mb,
        error_pct,
        frame_mb,
    } = traffic;
    let bound = match *bound_mb > 0.0 {
        true => format!(
            ", {:.2} times the bound of {}",
            texture_mb / bound_mb,
            size(*bound_mb)
        ),
        false => String::new(),
    };
    let share = frame_mb.filter(|mb| *mb > 0.0).map(|mb| {
        let pct = 100.0 * texture_mb / mb;
        format!(", {pct:.1} % of the frame's DRAM traffic of {}", size(mb))
    });
    let mut out = vec![format!(
        "{of}: {} of texture per frame from DRAM (known errors: {error_pct:.1} %){}{bound}.",
        size(*texture_mb),
        share.unwrap_or_default()
    )];
    if *texture_mb <= 0.0 {
        out.push("The trace samples no texture.".to_owned());
    } else if texture_mb <= bound_mb {
        out.push("The L2 holds everything; no order can save.".to_owned());
    }
    out
}

/// Beginning of the sentence about the machine.
pub const MACHINE: &str = "Machine: ";

/// The machine of the figures. `caches_bytes` are the sizes of L1 and L2, `frames` those of each trace.
pub fn machine(
    config: &RunConfig,
    caches_bytes: impl IntoIterator<Item = [u64; 2]>,
    frames: &[u32],
) -> String {
    let all = count(frames.iter().sum::<u32>() as usize, "frame");
    let of = match frames.len() {
        1 => all,
        traces => format!("{} with {all}", count(traces, "trace")),
    };
    let hardware = hardware(config, caches_bytes);
    format!("{hardware}, {} mode; {of}.", config.mode_name())
}

/// The beginning of [`machine`]: caches and cores, and the preset's name if it is one.
pub fn hardware(config: &RunConfig, caches_bytes: impl IntoIterator<Item = [u64; 2]>) -> String {
    let caches = match unique(caches_bytes).as_slice() {
        [[l1, l2]] => format!("L1 {}, L2 {}", format_bytes(*l1), format_bytes(*l2)),
        several => {
            let kib = |bytes: u64| bytes as f64 / 1024.0;
            let pairs = several
                .iter()
                .map(|[l1, l2]| format!("{}/{}", kib(*l1), kib(*l2)));
            format!("L1/L2 {} KiB", pairs.collect::<Vec<_>>().join(", "))
        }
    };
    // DRAM changes none of the figures that stand beside this sentence.
    let without_dram = |config: RunConfig| RunConfig {
        dram: None,
        ..config
    };
    let is_config = |preset: &Preset| {
        preset.machine().is_some() && without_dram(preset.over(*config)) == without_dram(*config)
    };
    let name = Preset::all()
        .find(is_config)
        .map(|preset| format!("{}, ", preset.name()));
    format!(
        "{MACHINE}{}{}; {}-byte lines, {}",
        name.unwrap_or_default(),
        caches,
        config.line_bytes,
        count(config.cores as usize, "core")
    )
}

/// A figure of a sample of frames.
pub struct Sampled {
    /// The order.
    pub order: String,
    /// L1 and L2, as in `16/256`.
    pub caches: String,
    /// As it is shown.
    pub figure: Figure,
}

/// The best of some sampled figures with its interval. `name` is the figure's, with its unit.
pub fn sampled(of: Of, name: &str, baseline: &str, rows: &[Sampled]) -> Option<String> {
    let value = |row: &&Sampled| row.figure.value;
    let best = match of {
        Of::Saving => rows.iter().max_by(|a, b| value(a).total_cmp(&value(b))),
        _ => rows.iter().min_by(|a, b| value(a).total_cmp(&value(b))),
    }?;
    let Figure {
        value, low, high, ..
    } = best.figure;
    let (order, caches) = (&best.order, &best.caches);
    Some(match of {
        Of::Saving => format!(
            "{order} saves {value:.2} % ({low:.2} to {high:.2} %) of the external bytes of {baseline} with L1/L2 {caches} KiB."
        ),
        _ => format!("{order} with L1/L2 {caches} KiB: {value:.2} ({low:.2} to {high:.2}) {name}."),
    })
}

/// A scheme of reuse against tracing both eyes in full.
pub struct Scheme {
    /// Name.
    pub name: &'static str,
    /// Frames per second, geometric mean.
    pub performance: f64,
    /// Energy, geometric mean.
    pub energy: f64,
    /// Its least and most value at 14 nm.
    pub energy_bounds: [f64; 2],
    /// Mean FLIP of both images.
    pub flip: f64,
}

/// The fastest scheme over `frames`, and the one that needs the least energy.
pub fn schemes(frames: usize, schemes: &[Scheme]) -> Vec<String> {
    let fastest = (schemes.iter()).max_by(|a, b| a.performance.total_cmp(&b.performance));
    let frugal = (schemes.iter()).min_by(|a, b| a.energy.total_cmp(&b.energy));
    let (Some(fastest), Some(frugal)) = (fastest, frugal) else {
        return Vec::new();
    };
    let energy = |of: &Scheme| {
        let [least, most] = of.energy_bounds;
        format!(
            "{:.2} times the energy ({least:.2} to {most:.2} at 14 nm)",
            of.energy
        )
    };
    let verdict = match fastest.performance >= 1.0 {
        true => format!("{} is the fastest scheme", fastest.name),
        false => format!(
            "No scheme is faster than tracing both eyes in full; {} comes closest",
            fastest.name
        ),
    };
    let mut out = vec![format!(
        "{verdict}: {:.2} times the frames per second of tracing both eyes in full, {}, mean FLIP {:.4} (mean of {}).",
        fastest.performance,
        energy(fastest),
        fastest.flip,
        count(frames, "frame")
    )];
    if frugal.name != fastest.name {
        out.push(format!(
            "{} takes the least energy: {}.",
            frugal.name,
            energy(frugal)
        ));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_replay_has_its_bound_its_warning_and_its_share_of_the_frame() {
        let mut traffic = Traffic {
            of: "atrium, Morton".to_owned(),
            texture_mb: 0.42,
            bound_mb: 0.15,
            error_pct: 0.39,
            frame_mb: None,
        };
        assert_eq!(
            replayed(&traffic),
            [
                "atrium, Morton: 0.42 MB of texture per frame from DRAM (known errors: 0.4 %), 2.80 times the bound of 0.15 MB."
            ]
        );
        (traffic.texture_mb, traffic.bound_mb, traffic.frame_mb) = (0.01, 0.01, Some(0.1));
        let text = replayed(&traffic);
        assert!(text[0].contains("10.0 kB"), "{text:?}");
        assert!(text[1].contains("no order can save"), "{text:?}");
        assert!(text[0].contains("10.0 % of the frame's"), "{text:?}");
        (traffic.texture_mb, traffic.bound_mb) = (0.0, 0.0);
        assert_eq!(replayed(&traffic)[1], "The trace samples no texture.");
    }

    #[test]
    fn a_machine_names_caches_mode_and_frames() {
        let config = RunConfig::default();
        assert_eq!(
            machine(&config, [[8 << 10, 128 << 10]], &[1]),
            "Machine: L1 8 KiB, L2 128 KiB; 16-byte lines, 2 cores, timed mode; 1 frame."
        );
        let several = machine(&config, [[1024, 2048], [1024, 2048], [1024, 4096]], &[1, 2]);
        assert!(several.contains("L1/L2 1/2, 1/4 KiB;"), "{several}");
        assert!(several.ends_with("2 traces with 3 frames."), "{several}");
    }

    #[test]
    fn a_sample_reports_its_largest_saving_with_the_interval() {
        let row = |value| Sampled {
            order: "z2-sta".to_owned(),
            caches: "16/256".to_owned(),
            figure: Figure {
                low: value - 1.0,
                high: value + 1.0,
                ..Figure::exact(value)
            },
        };
        assert_eq!(sampled(Of::Saving, "", "morton", &[]), None);
        assert_eq!(
            sampled(Of::Saving, "", "morton", &[row(1.0), row(40.0)]).unwrap(),
            "z2-sta saves 40.00 % (39.00 to 41.00 %) of the external bytes of morton with L1/L2 16/256 KiB."
        );
        let bytes = sampled(Of::Bytes, "external bytes per frame", "", &[row(5.0)]).unwrap();
        assert!(bytes.contains("5.00 (4.00 to 6.00) external"), "{bytes}");
    }

    #[test]
    fn the_fastest_scheme_and_the_frugal_one_are_named() {
        let scheme = |name, performance, energy| Scheme {
            name,
            performance,
            energy,
            energy_bounds: [0.9 * energy, 1.1 * energy],
            flip: 0.01,
        };
        assert!(schemes(1, &[]).is_empty());
        let one = schemes(1, &[scheme("stereo", 1.2, 0.9)]);
        assert_eq!(
            one,
            [
                "stereo is the fastest scheme: 1.20 times the frames per second of tracing both eyes in full, \
                 0.90 times the energy (0.81 to 0.99 at 14 nm), mean FLIP 0.0100 (mean of 1 frame)."
            ]
        );
        let slow = schemes(1, &[scheme("stereo", 0.98, 1.1)]);
        assert!(slow[0].starts_with("No scheme is faster"), "{slow:?}");
        let two = schemes(2, &[scheme("stereo", 1.2, 0.9), scheme("both", 1.4, 1.0)]);
        assert!(
            two[0].starts_with("both") && two[1].starts_with("stereo takes the least"),
            "{two:?}"
        );
    }
}
